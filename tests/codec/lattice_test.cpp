// SPDX-License-Identifier: MIT
#include "proto/codec/lattice/lattice.h"

#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {
namespace {

double errorOf(float x, LatticeScale scale) {
  return std::fabs(static_cast<double>(x) - static_cast<double>(reconstruct(quantise(x, scale), scale)));
}

TEST(Lattice, KeepsTheMaxErrorWithinThirtyTwoMetres) {
  std::mt19937 random(1);
  for (const float maxError : {1e-5f, 0.00013f, 0.0005f, 0.001f, 0.1f}) {
    const LatticeScale scale = latticeScale(maxError);
    std::uniform_real_distribution<float> anywhere(-32.0f, 32.0f), near(-1.0f, 1.0f);
    for (int i = 0; i < 200'000; ++i) {
      const float x = i % 2 == 0 ? anywhere(random) : near(random);
      ASSERT_LE(errorOf(x, scale), static_cast<double>(maxError)) << x << " at " << maxError;
    }
  }
}

TEST(Lattice, KeepsTheMaxErrorHalfWayBetweenPoints) {
  // Where rounding decides: the floats round the middle of two lattice points, all over the range.
  std::mt19937 random(2);
  for (const float maxError : {1e-5f, 0.0005f, 0.07f}) {
    const LatticeScale scale = latticeScale(maxError);
    std::uniform_int_distribution<int> point(0, static_cast<int>(31.9f / scale.step));
    for (int i = 0; i < 50'000; ++i) {
      float x = static_cast<float>((point(random) + 0.5) * static_cast<double>(scale.step));
      for (int k = 0; k < 3; ++k) x = std::nextafter(x, 0.0f);
      for (int k = 0; k < 7; ++k, x = std::nextafter(x, 33.0f)) {
        ASSERT_LE(errorOf(x, scale), static_cast<double>(maxError)) << x;
        ASSERT_LE(errorOf(-x, scale), static_cast<double>(maxError)) << -x;
      }
    }
  }
}

TEST(Lattice, WastesLessThanOnePercentOfTheErrorAtHalfAMillimetre) {
  EXPECT_GT(latticeScale(0.0005f).step, 0.99f * 2 * 0.0005f);
  EXPECT_LE(latticeScale(0.0005f).step, 2 * 0.0005f);
}

TEST(Lattice, MovesWhatLiesBeyondToItsEdge) {
  const LatticeScale scale = latticeScale(0.0005f);
  constexpr float infinity = std::numeric_limits<float>::infinity();
  EXPECT_EQ(quantise(1e30f, scale), kLatticeLimit);
  EXPECT_EQ(quantise(-1e30f, scale), -kLatticeLimit);
  EXPECT_EQ(quantise(infinity, scale), kLatticeLimit);
  EXPECT_EQ(quantise(-infinity, scale), -kLatticeLimit);
  EXPECT_EQ(quantise(std::numeric_limits<float>::quiet_NaN(), scale), -kLatticeLimit);
}

TEST(Lattice, HasAPositiveStepForEveryPossibleMaxError) {
  for (const float maxError : {kSmallestMaxError, 1e-5f, kLargestMaxError}) {
    const LatticeScale scale = latticeScale(maxError);
    EXPECT_GT(scale.step, 0.0f);
    EXPECT_TRUE(std::isfinite(scale.inverseStep));
  }
}

}  // namespace
}  // namespace clothstream::codec
