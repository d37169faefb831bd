// SPDX-License-Identifier: MIT
#include "proto/codec/lattice/prediction.h"

#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

template <typename T>
std::vector<T> anyValues(std::size_t count, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<T> values(count);
  for (T& value : values) value = static_cast<T>(random());
  return values;
}

template <typename T>
void expectInverse() {
  const StreamLayout layout = mixedLayout(NormalMode::none);
  const std::size_t n = layout.vertexCount();
  const std::vector<T> values = anyValues<T>(n, 1), reference = anyValues<T>(n, 2);
  for (std::size_t p = 0; p < kPredictionCount; ++p) {
    const auto prediction = static_cast<Prediction>(p);
    std::vector<T> residuals(n);
    predict(layout, prediction, values.data(), reference.data(), residuals.data());
    EXPECT_NE(residuals, values) << p;
    reconstruct(layout, prediction, residuals.data(), reference.data(), residuals.data());
    EXPECT_EQ(residuals, values) << p;
  }
}

TEST(Prediction, IsUndoneByReconstructionForAnyValues) {
  expectInverse<std::int32_t>();
  expectInverse<std::int8_t>();
}

TEST(Prediction, OfAPlaneLeavesNothingButItsEdges) {
  const StreamLayout layout{.epoch = 1, .cloths = {{.vertexCount = 20, .rows = 4, .columns = 5}}};
  std::vector<std::int32_t> values, residuals(20);
  for (int i = 0; i < 20; ++i) values.push_back(100 + 7 * (i % 5) - 3 * (i / 5));
  predict<std::int32_t>(layout, Prediction::planar, values.data(), nullptr, residuals.data());
  for (std::size_t i = 0; i < 20; ++i) {
    const int expected = i == 0 ? 100 : i < 5 ? 7 : i % 5 == 0 ? -3 : 0;
    EXPECT_EQ(residuals[i], expected) << i;
  }
}

TEST(Prediction, OfAUniformMotionLeavesOnlyItsFirstVertex) {
  const StreamLayout layout{.epoch = 1, .cloths = {{.vertexCount = 20, .rows = 4, .columns = 5}}};
  const std::vector<std::int32_t> reference = anyValues<std::int32_t>(20, 3);
  std::vector<std::int32_t> values, residuals(20);
  for (const std::int32_t r : reference) values.push_back(r - 9);
  for (const Prediction prediction : {Prediction::temporalAverage, Prediction::temporalPlanar}) {
    predict(layout, prediction, values.data(), reference.data(), residuals.data());
    EXPECT_EQ(residuals[0], -9);
    for (std::size_t i = 1; i < 20; ++i) EXPECT_EQ(residuals[i], 0) << i;
  }
}

TEST(Prediction, ChosenIsTheCheapestThatTheFrameMayUse) {
  const StreamLayout layout = mixedLayout(NormalMode::none);
  std::vector<std::int32_t> still(layout.vertexCount()), moved;
  std::mt19937 random(4);
  for (std::int32_t& value : still) value = static_cast<std::int32_t>(random() % 1000);
  PredictionCosts costs{};
  measure(layout, still.data(), still.data(), costs);
  EXPECT_EQ(costs[static_cast<std::size_t>(Prediction::temporal)], 0u);
  EXPECT_EQ(cheapest(costs, true), Prediction::temporal);
  EXPECT_FALSE(needsReference(cheapest(costs, false)));
}

TEST(Prediction, ZigzagIsUndoneAtTheEnds) {
  for (const std::int32_t value : {0, -1, 1, -2, 127, -128, std::numeric_limits<std::int32_t>::max(),
                                   std::numeric_limits<std::int32_t>::min()}) {
    EXPECT_EQ(unzigzag(zigzag(value)), value);
  }
  EXPECT_EQ(zigzag(-1), 1u);
  EXPECT_EQ(zigzag(1), 2u);
}

}  // namespace
}  // namespace clothstream::codec
