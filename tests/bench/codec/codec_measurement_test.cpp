// SPDX-License-Identifier: MIT
// Checks the measurement with codecs whose errors are known.
#include "tests/bench/codec/codec_measurement.h"

#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kVertices = 6;
const codec::ClothLayout kCloth{kVertices, 2, 3, {}, {}};

// Decodes to what the functions make of a frame, from packets of a given size.
struct Behaviour {
  std::function<void(std::uint32_t frame, std::vector<float>& positions)> spoil = [](auto, auto&) {};
  std::function<std::array<float, 3>(std::uint32_t frame)> normal =
      {};  // for all vertices; none: it sends no normals
  std::function<std::size_t(std::uint32_t frame)> bytes = [](auto) { return 3; };
};

class FakeCodec final : public FrameCodec {
 public:
  explicit FakeCodec(Behaviour behaviour) : behaviour_(std::move(behaviour)) {}

  std::string name() const override { return "fake"; }
  double promise() const override { return 0.002; }
  std::span<const std::byte> encode(const TrueFrame& frame) override {
    frame_ = frame.frame;
    positions_.assign(frame.positions.begin(), frame.positions.end());
    packet_.resize(behaviour_.bytes(frame_));
    return packet_;
  }
  std::span<const float> decode(std::span<const std::byte>) override {
    behaviour_.spoil(frame_, positions_);
    normals_.clear();
    if (behaviour_.normal)
      for (std::uint32_t vertex = 0; vertex < kVertices; ++vertex)
        for (const float component : behaviour_.normal(frame_)) normals_.push_back(component);
    return positions_;
  }
  std::span<const float> normals() const override { return normals_; }

 private:
  Behaviour behaviour_;
  std::uint32_t frame_ = 0;
  std::vector<std::byte> packet_;
  std::vector<float> positions_, normals_;
};

// A flat cloth that faces +Z. Its last vertex moves by `step` each frame.
nlohmann::ordered_json measured(Behaviour behaviour, std::uint32_t frames = 4, float step = 0) {
  CodecMeasurement measurement(std::make_unique<FakeCodec>(std::move(behaviour)), kCloth, 0.001);
  Truth truth(kCloth);
  std::vector<float> positions{0, 0, 0, 1, 0, 0, 2, 0, 0, 0, -1, 0, 1, -1, 0, 2, -1, 0};
  for (std::uint32_t frame = 0; frame < frames; ++frame) {
    measurement.add(truth.next(positions));
    positions[3 * (kVertices - 1)] += step;
  }
  return measurement.row("test");
}

double value(const nlohmann::ordered_json& row, const char* field) {
  return row.at(field).get<double>();
}

std::array<float, 3> tilted(double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  return {static_cast<float>(std::sin(angle)), 0, static_cast<float>(std::cos(angle))};
}

TEST(CodecMeasurement, CountsEveryByteOfEveryFrame) {
  const auto row = measured({.bytes = [](std::uint32_t frame) { return frame == 0 ? 21u : 3u * frame; }}, 5);
  EXPECT_EQ(row.at("keyBytes"), 21);
  EXPECT_DOUBLE_EQ(value(row, "bitsPerVertex"), 8.0 * (21 + 3 + 6 + 9 + 12) / (5 * kVertices));
  EXPECT_DOUBLE_EQ(value(row, "bitsPerVertexP50"), 8.0 * 9 / kVertices);
  EXPECT_DOUBLE_EQ(value(row, "bitsPerVertexP95"), 8.0 * 21 / kVertices);
  for (const char* field : {"measuredMaxErrorMm", "meanErrorMm", "normalErrorDegMean", "normalFlickerDegRms"})
    EXPECT_EQ(value(row, field), 0) << field;
}

TEST(CodecMeasurement, ReportsDistancesOfVertices) {
  const auto row = measured({.spoil = [](std::uint32_t frame, std::vector<float>& positions) {
    positions[2] += frame == 1 ? 0.0015f : 0.0005f;
  }});
  EXPECT_NEAR(value(row, "measuredMaxErrorMm"), 1.5, 1e-6);
  EXPECT_NEAR(value(row, "meanErrorMm"), (1.5 + 3 * 0.5) / (4 * kVertices), 1e-6);
}

TEST(CodecMeasurement, FailsIfAPromiseIsBroken) {
  EXPECT_THROW(
      measured({.spoil = [](std::uint32_t, std::vector<float>& positions) { positions[4] += 0.0021f; }}),
      std::runtime_error);
  EXPECT_THROW(measured({.spoil = [](std::uint32_t, std::vector<float>& positions) { positions[4] = NAN; }}),
               std::runtime_error);
}

TEST(CodecMeasurement, UsesSentNormalsIfThereAreAny) {
  const auto sent = measured({.normal = [](std::uint32_t) { return tilted(3); }});
  EXPECT_NEAR(value(sent, "normalErrorDegMean"), 3, 1e-4);
  EXPECT_NEAR(value(sent, "normalErrorDegP99"), 3, 1e-4);
  EXPECT_EQ(value(sent, "normalFlickerDegRms"), 0) << "what stays wrong does not flicker";
  // The whole cloth is turned: 1.8 mm at 2 m.
  const auto computed = measured({.spoil = [](std::uint32_t, std::vector<float>& positions) {
    for (std::size_t i = 0; i < positions.size(); i += 3) positions[i + 2] += 0.0009f * positions[i];
  }});
  EXPECT_NEAR(value(computed, "normalErrorDegMean"), std::atan(0.0009) * 180 / std::numbers::pi, 1e-5);
}

TEST(CodecMeasurement, MeasuresFlickerAsChangeOfNormalErrors) {
  // From one side to the other each time: twice the error.
  const auto row = measured({.normal = [](std::uint32_t frame) { return tilted(frame % 2 == 0 ? 1 : -1); }});
  EXPECT_NEAR(value(row, "normalErrorDegMean"), 1, 1e-4);
  EXPECT_NEAR(value(row, "normalFlickerDegRms"), 2, 1e-3);
  EXPECT_NEAR(value(row, "normalFlickerCalmDegRms"), 2, 1e-3);
  EXPECT_EQ(value(row, "calmPart"), 1);
  // Once in three changes.
  const auto once = measured({.normal = [](std::uint32_t frame) { return tilted(frame < 3 ? 0 : 1); }});
  EXPECT_NEAR(value(once, "normalFlickerDegRms"), std::sqrt(1.0 / 3), 1e-3);
}

TEST(CodecMeasurement, TreatsSlowVerticesAsCalm) {
  EXPECT_DOUBLE_EQ(value(measured({}, 3, 0.9f * static_cast<float>(kCalmMetres)), "calmPart"), 1);
  EXPECT_NEAR(value(measured({}, 3, 1.1f * static_cast<float>(kCalmMetres)), "calmPart"), 5.0 / 6, 1e-9);
}

}  // namespace
}  // namespace clothstream::bench
