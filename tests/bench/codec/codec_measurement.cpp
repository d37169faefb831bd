// SPDX-License-Identifier: MIT
#include "tests/bench/codec/codec_measurement.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "proto/codec/vertex_normals.h"

namespace clothstream::bench {
namespace {

// The 99th percentile needs no more samples.
constexpr std::uint32_t kNormalSamplesEvery = 10;

constexpr double kDegrees = 180 / std::numbers::pi;

codec::StreamLayout layoutOf(const codec::ClothLayout& cloth) {
  return {.cloths = {cloth}};
}

double squaredDistance(const float* a, const float* b) {
  const auto off = [&](int c) { return double{a[c]} - double{b[c]}; };
  return off(0) * off(0) + off(1) * off(1) + off(2) * off(2);
}

}  // namespace

CodecMeasurement::CodecMeasurement(std::unique_ptr<FrameCodec> codec, const codec::ClothLayout& cloth,
                                   double maxError)
    : codec_(std::move(codec)),
      layout_(layoutOf(cloth)),
      maxError_(maxError),
      normals_(3 * std::size_t{cloth.vertexCount}),
      normalError_(normals_.size()),
      normalErrorBefore_(normals_.size()) {}

void CodecMeasurement::add(const TrueFrame& frame) {
  std::span<const std::byte> packet;
  std::span<const float> decoded;
  encode_.add(secondsOf([&] { packet = codec_->encode(frame); }));
  decode_.add(secondsOf([&] { decoded = codec_->decode(packet); }));
  codec_->check();
  if (frames_ == 0) keyBytes_ = packet.size();
  bytes_.add(static_cast<double>(packet.size()));
  addErrors(frame, decoded);
  addNormals(frame, decoded);
  ++frames_;
}

void CodecMeasurement::addErrors(const TrueFrame& frame, std::span<const float> decoded) {
  for (std::size_t i = 0; i < decoded.size(); i += 3) {
    const double distance = std::sqrt(squaredDistance(&decoded[i], &frame.positions[i]));
    if (!(distance <= codec_->promise()))
      throw std::runtime_error(fmt::format("{}: in frame {}, vertex {} is {} m off; {} m are promised",
                                           codec_->name(), frame.frame, i / 3, distance, codec_->promise()));
    largest_ = std::max(largest_, distance);
    errorSum_ += distance;
  }
}

void CodecMeasurement::addNormals(const TrueFrame& frame, std::span<const float> decoded) {
  std::span<const float> normals = codec_->normals();
  if (normals.empty()) {
    codec::computeVertexNormals(layout_, decoded.data(), normals_.data());
    normals = normals_;
  }
  std::swap(normalError_, normalErrorBefore_);
  std::ranges::transform(normals, frame.normals, normalError_.begin(), std::minus());
  constexpr float kNone[3] = {};
  for (std::size_t i = 0; i < normals.size(); i += 3) {
    const double chord = std::sqrt(squaredDistance(&normalError_[i], kNone));
    const double angle = 2 * kDegrees * std::asin(std::min(1.0, chord / 2));
    normalErrorSum_ += angle;
    if (frame.frame % kNormalSamplesEvery == 0) normalErrors_.add(angle);
    if (frames_ == 0) continue;
    const double change = squaredDistance(&normalError_[i], &normalErrorBefore_[i]);
    flickerSum_ += change;
    if (frame.calm[i / 3] == 0) continue;
    calmFlickerSum_ += change;
    ++calm_;
  }
}

nlohmann::ordered_json CodecMeasurement::row(const std::string& motion) const {
  const codec::ClothLayout& cloth = layout_.cloths.front();
  const double vertices = cloth.vertexCount, bits = 8 / vertices,
               all = vertices * static_cast<double>(frames_),
               changes = vertices * static_cast<double>(frames_ - 1);
  nlohmann::ordered_json row{
      {"suite", "codec"},
      {"motion", motion},
      {"codec", codec_->name()},
      {"cloth", cloth.rows > 0 ? fmt::format("{}x{}", cloth.columns, cloth.rows) : "mesh"},
      {"vertices", cloth.vertexCount},
      {"frames", frames_},
      {"maxErrorMm", std::round(maxError_ * 1e9) / 1e6},
      {"bitsPerVertex", bytes_.mean() * bits},
      {"bitsPerVertexP50", bytes_.median() * bits},
      {"bitsPerVertexP95", bytes_.quantile(0.95) * bits},
      {"keyBytes", keyBytes_},
      {"encodeMs", encode_.median() * 1e3},
      {"encodeMsMin", encode_.min() * 1e3},
      {"encodeMsP99", encode_.p99() * 1e3},
      {"decodeMs", decode_.median() * 1e3},
      {"decodeMsMin", decode_.min() * 1e3},
      {"decodeMsP99", decode_.p99() * 1e3},
      {"measuredMaxErrorMm", largest_ * 1e3},
      {"meanErrorMm", errorSum_ / all * 1e3},
      {"normalErrorDegMean", normalErrorSum_ / all},
      {"normalErrorDegP99", normalErrors_.p99()},
      {"normalFlickerDegRms", frames_ > 1 ? kDegrees * std::sqrt(flickerSum_ / changes) : 0}};
  // There is no value if no vertex is calm.
  if (calm_ > 0)
    row["normalFlickerCalmDegRms"] = kDegrees * std::sqrt(calmFlickerSum_ / static_cast<double>(calm_));
  row["calmPart"] = frames_ > 1 ? static_cast<double>(calm_) / changes : 0;
  return row;
}

Truth::Truth(const codec::ClothLayout& cloth)
    : layout_(layoutOf(cloth)), normals_(3 * std::size_t{cloth.vertexCount}), calm_(cloth.vertexCount) {}

TrueFrame Truth::next(std::span<const float> positions) {
  codec::computeVertexNormals(layout_, positions.data(), normals_.data());
  for (std::size_t i = 0; i < before_.size(); i += 3)
    calm_[i / 3] = squaredDistance(&positions[i], &before_[i]) < kCalmMetres * kCalmMetres ? 1 : 0;
  before_.assign(positions.begin(), positions.end());
  return {frame_++, positions, normals_, calm_};
}

}  // namespace clothstream::bench
