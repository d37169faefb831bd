// SPDX-License-Identifier: MIT
#include "proto/codec/reach.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"

namespace clothstream::codec {
namespace {

std::vector<float> maxErrors() {
  std::vector<float> errors;
  for (float error = kSmallestMaxError; error <= kLargestMaxError; error *= 1.07f) errors.push_back(error);
  return errors;
}

TEST(Reach, IsThatOfTheDocumentation) {
  EXPECT_NEAR(reachOf(0.000005f), 41.5, 0.1);
  EXPECT_NEAR(reachOf(0.00001f), 60.3, 0.1);
  EXPECT_NEAR(reachOf(0.00005f), 49.6, 0.1);
  EXPECT_NEAR(reachOf(0.0005f), 514.2, 0.1);
}

TEST(Reach, IsAtLeastFortyMetres) {
  for (const float error : maxErrors()) EXPECT_GE(reachOf(error), 39.99f) << error;
}

double largestDistance(std::span<const float> a, std::span<const float> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); i += 3)
    largest = std::max(
        largest, std::hypot(double{a[i]} - b[i], double{a[i + 1]} - b[i + 1], double{a[i + 2]} - b[i + 2]));
  return largest;
}

TEST(Reach, CoordinatesWithinItKeepThePromise) {
  for (const float error : maxErrors()) {
    const StreamLayout layout{.maxError = error, .cloths = {{.vertexCount = 12, .rows = 3, .columns = 4}}};
    const auto encoder = Encoder::make(layout);
    const auto decoder = Decoder::make(layout);
    std::vector<std::byte> packet(encoder->packetBound());
    std::mt19937 random(1);
    const float reach = reachOf(error);
    for (std::uint64_t tick = 1; tick <= 6; ++tick) {
      std::vector<float> positions(3 * 12);
      for (float& x : positions) {
        // Both ends, and everything between.
        const auto place = random() % 5;
        x = place == 0   ? reach
            : place == 1 ? -reach
                         : std::ldexp(reach, -30) * static_cast<float>(random() >> 2);
      }
      const std::size_t bytes = encoder->encode(tick, PacketKind::predicted, positions, {}, packet);
      ASSERT_EQ(decoder->decode(std::span(packet).first(bytes)), DecodeResult::ok) << error;
      EXPECT_LE(largestDistance(positions, decoder->positions()), promisedDistance(error, reach)) << error;
    }
  }
}

TEST(Reach, CoordinatesBeyondItBecomeItsEnd) {
  const StreamLayout layout{.maxError = 0.0005f, .cloths = {{.vertexCount = 1, .rows = 1, .columns = 1}}};
  const auto encoder = Encoder::make(layout);
  const auto decoder = Decoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  const std::vector<float> far{800, -1e30f, 3};
  const std::size_t bytes = encoder->encode(1, PacketKind::key, far, {}, packet);
  ASSERT_EQ(decoder->decode(std::span(packet).first(bytes)), DecodeResult::ok);
  EXPECT_NEAR(decoder->positions()[0], reachOf(0.0005f), 0.001);
  EXPECT_NEAR(decoder->positions()[1], -reachOf(0.0005f), 0.001);
}

TEST(Reach, FarthestCoordinateDecidesThePromise) {
  EXPECT_EQ(farthestOf({}), 0);
  const std::vector<float> positions{1, -20, 3, 4, 15, 0};
  EXPECT_EQ(farthestOf(positions), 20);
  EXPECT_GT(promisedDistance(0.0001f, farthestOf(positions)), promisedDistance(0.0001f, 16));
  EXPECT_EQ(promisedDistance(0.0001f, 16), promisedDistance(0.0001f, 0));
}

TEST(Reach, StreamHasThatOfItsNarrowestQuality) {
  // Quality 0 has four bits in a step and reaches 71 m; quality 1 has six and reaches 49 m.
  const float error = 0.00000726f;
  ASSERT_GT(reachOf(error), 60);
  ASSERT_LT(reachOf(maxErrorOf(error, 1)), 60);
  EXPECT_EQ(reachOf(error, 2), reachOf(maxErrorOf(error, 1)));
  for (const float finest : maxErrors())
    for (std::uint8_t quality = 0; quality < kMaxQualities; ++quality)
      EXPECT_LE(reachOf(finest, kMaxQualities), reachOf(maxErrorOf(finest, quality))) << finest;
}

TEST(Reach, MaxErrorForACoordinateHoldsItAndSoDoLargerOnes) {
  for (const float coordinate : {1.0f, 40.0f, 60.0f, 514.3f, 800.0f, 1000.0f}) {
    const float least = maxErrorFor(coordinate);
    EXPECT_LT(least, 0.001f);
    EXPECT_GE(reachOf(maxErrorFor(1e30f)), 1e30f);
    for (float error = least; error < 1; error *= 1.01f)
      EXPECT_GE(reachOf(error, kMaxQualities), coordinate) << error;
  }
}

}  // namespace
}  // namespace clothstream::codec
