// SPDX-License-Identifier: MIT
// Suite codec_motions: both codecs over four motions that they were not fitted to; codec 2 with temporal
// layers, and of the cloth as a mesh, too.
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "proto/codec/vertex_normals.h"
#include "tests/bench/cloth_motion.h"
#include "tests/bench/samples.h"
#include "tests/bench/suite.h"
#include "tests/codec/cut_grid.h"

namespace clothstream::bench {
namespace {

constexpr float kMaxError = 0.0005f;
// The history of a stream builds up in the first frames: means are over those after it.
constexpr std::uint32_t kFirstFrame = 8;
constexpr std::uint32_t kNormalsEvery = 10;

double degreesBetween(const float* a, const float* b) {
  const double ax = a[0], ay = a[1], az = a[2], bx = b[0], by = b[1], bz = b[2];
  const double sine = std::hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx);
  return std::atan2(sine, ax * bx + ay * by + az * bz) * 180 / std::numbers::pi;
}

// One codec's way through a motion.
class Measurement {
 public:
  explicit Measurement(const codec::StreamLayout& layout)
      : layout_(layout),
        encoder_(codec::Encoder::make(layout)),
        decoder_(codec::Decoder::make(layout)),
        packet_(encoder_->packetBound()),
        trueNormals_(3 * std::size_t{layout.vertexCount()}) {}

  void add(std::uint32_t frame, std::span<const float> positions) {
    std::size_t bytes = 0;
    const auto kind = codec::PacketKind::predicted;
    const double encode =
        secondsOf([&] { bytes = encoder_->encode(frame + 1, kind, positions, {}, packet_); });
    codec::DecodeResult result{};
    const double decode = secondsOf([&] { result = decoder_->decode(std::span(packet_).first(bytes)); });
    if (result != codec::DecodeResult::ok || decoder_->reconstructionHash() != encoder_->reconstructionHash())
      throw std::runtime_error(fmt::format("frame {} is not decoded to what was encoded", frame));
    addErrors(positions);
    if (frame == 0) keyBytes_ = bytes;
    if (frame < kFirstFrame) return;
    bytes_.add(static_cast<double>(bytes));
    sum_ += static_cast<double>(bytes);
    encode_.add(encode);
    decode_.add(decode);
    if (frame % kNormalsEvery == 0) addNormals(positions);
  }

  nlohmann::ordered_json row(const std::string& motion) const {
    const double vertices = layout_.vertexCount(), bits = 8 / vertices;
    const double promise = std::sqrt(3.0) * static_cast<double>(layout_.maxError);
    if (largest_ > promise)
      throw std::runtime_error(
          fmt::format("{}: a vertex is {} m off; {} m are promised", motion, largest_, promise));
    return {{"suite", "codec_motions"},
            {"motion", motion},
            {"codec", layout_.codec},
            {"cloth", layout_.cloths[0].rows > 0 ? "grid" : "mesh"},
            {"temporalLayers", layout_.temporalLayers},
            {"nodes", layout_.vertexCount()},
            {"maxErrorMm", layout_.maxError * 1e3},
            {"bitsPerVertex", sum_ / static_cast<double>(bytes_.count()) * bits},
            {"bitsPerVertexP50", bytes_.median() * bits},
            {"bitsPerVertexP95", bytes_.quantile(0.95) * bits},
            {"keyBytes", keyBytes_},
            {"encodeMs", encode_.median() * 1e3},
            {"decodeMs", decode_.median() * 1e3},
            {"measuredMaxErrorMm", largest_ * 1e3},
            {"meanErrorMm", errorSum_ / errorCount_ * 1e3},
            {"normalErrorDegMean", normalSum_ / static_cast<double>(normals_.count())},
            {"normalErrorDegP99", normals_.p99()},
            {"frames", bytes_.count()}};
  }

 private:
  void addErrors(std::span<const float> positions) {
    const std::span<const float> decoded = decoder_->positions();
    for (std::size_t i = 0; i < positions.size(); i += 3) {
      const auto off = [&](std::size_t c) {
        return static_cast<double>(positions[i + c]) - static_cast<double>(decoded[i + c]);
      };
      const double distance = std::hypot(off(0), off(1), off(2));
      largest_ = std::max(largest_, distance);
      errorSum_ += distance;
      errorCount_ += 1;
    }
  }

  void addNormals(std::span<const float> positions) {
    codec::computeVertexNormals(layout_, positions.data(), trueNormals_.data());
    const std::span<const float> decoded = decoder_->normals();
    for (std::size_t i = 0; i < decoded.size(); i += 3) {
      const double angle = degreesBetween(&decoded[i], &trueNormals_[i]);
      normals_.add(angle);
      normalSum_ += angle;
    }
  }

  codec::StreamLayout layout_;
  std::unique_ptr<codec::Encoder> encoder_;
  std::unique_ptr<codec::Decoder> decoder_;
  std::vector<std::byte> packet_;
  std::vector<float> trueNormals_;
  Samples bytes_, encode_, decode_, normals_;
  double sum_ = 0, largest_ = 0, errorSum_ = 0, errorCount_ = 0, normalSum_ = 0;
  std::size_t keyBytes_ = 0;
};

}  // namespace

Rows runCodecMotions(vulkan::Device&, const Settings& settings) {
  std::array<MotionSettings, 4> motions{
      MotionSettings{.name = "drape", .scene = MotionScene::drape},
      MotionSettings{.name = "curtain", .scene = MotionScene::curtain},
      MotionSettings{.name = "light flag", .scene = MotionScene::flag, .wind = 0.5},
      MotionSettings{.name = "violent flag", .scene = MotionScene::flag}};
  Rows rows;
  for (MotionSettings& motion : motions) {
    motion.size = settings.size.value_or(motion.size);
    codec::StreamLayout layout{
        .epoch = 1, .maxError = kMaxError, .cloths = {{motion.size * motion.size, motion.size, motion.size}}};
    std::vector<Measurement> measurements;
    measurements.emplace_back(layout);
    layout.codec = codec::kCodecHierarchical;
    for (layout.temporalLayers = 1; layout.temporalLayers <= codec::kMaxTemporalLayers;
         ++layout.temporalLayers)
      measurements.emplace_back(layout);
    layout.temporalLayers = 1;
    codec::CutGrid mesh(motion.size);
    layout.cloths = {mesh.cloth()};
    Measurement ofMesh(layout);
    playMotion(motion, [&](std::uint32_t frame, std::span<const float> positions) {
      for (Measurement& measurement : measurements) measurement.add(frame, positions);
      ofMesh.add(frame, mesh.renumbered(positions));
    });
    measurements.push_back(std::move(ofMesh));
    for (const Measurement& measurement : measurements) rows.push_back(measurement.row(motion.name));
  }
  return rows;
}

}  // namespace clothstream::bench
