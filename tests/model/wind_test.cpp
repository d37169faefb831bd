// SPDX-License-Identifier: MIT
// Gusts are bounded, smooth and the same in every run.
#include "server/model/wind.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include <gtest/gtest.h>

#include "server/model/stability.h"

namespace clothstream::model {
namespace {

Scene gustyScene() {
  Scene scene;
  scene.environment.wind = Vec3(3, -1, 0.5f);
  scene.environment.gust = {.strength = 2, .seconds = 1};
  return scene;
}

TEST(Wind, EqualsItsMeanWithoutGusts) {
  Scene scene = gustyScene();
  scene.environment.gust.strength = 0;
  const Environment now = environmentAt(scene, 12345);
  EXPECT_EQ(std::memcmp(now.wind.data(), scene.environment.wind.data(), sizeof(Vec3)), 0);
  EXPECT_EQ(now.gravity, scene.environment.gravity);
}

TEST(Wind, DeviatesByAtMostItsStrength) {
  const Scene scene = gustyScene();
  Eigen::Array3f most = Eigen::Array3f::Zero();
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  constexpr std::uint64_t kTicks = 72 * 600;
  for (std::uint64_t tick = 0; tick < kTicks; ++tick) {
    const Eigen::Array3f strayed = environmentAt(scene, tick).wind - scene.environment.wind;
    most = most.max(strayed.abs());
    sum += strayed.cast<double>();
  }
  // 600 periods of a noise from -2 to 2 with a standard deviation of about 0.9. The mean is within four
  // deviations of the mean, and the largest value is close to the maximum.
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_LE(most[axis], 2) << axis;
    EXPECT_GT(most[axis], 1.4f) << axis;
    EXPECT_NEAR(sum[axis] / kTicks, 0, 4 * 0.9 / std::sqrt(600.0)) << axis;
  }
}

// Smoothstep moves at most 1.5 times as fast as a straight line. Long periods have 2/3 of twice the strength,
// short ones 1/3 at three times the speed.
TEST(Wind, ChangesSmoothly) {
  const Scene scene = gustyScene();
  const float most = 1.5f * 2 * 2 * (2.0f / 3 + 1.0f / 3 * 3) / 72 * 1.01f;
  for (std::uint64_t tick = 0; tick < 72 * 60; ++tick) {
    const Vec3 step = environmentAt(scene, tick + 1).wind - environmentAt(scene, tick).wind;
    ASSERT_LE(step.cwiseAbs().maxCoeff(), most) << tick;
  }
}

TEST(Wind, IsSlowerWithLongerPeriods) {
  Scene scene = gustyScene();
  const auto fastest = [&] {
    float most = 0;
    for (std::uint64_t tick = 0; tick < 72 * 60; ++tick)
      most = std::max(most, (environmentAt(scene, tick + 1).wind - environmentAt(scene, tick).wind).norm());
    return most;
  };
  const float quick = fastest();
  scene.environment.gust.seconds = 10;
  EXPECT_LT(fastest(), quick / 5);
}

// Integer arithmetic: these bits are the same on every machine and in every later version.
TEST(Wind, HasTheRecordedBits) {
  const Scene scene = gustyScene();
  std::uint32_t bits[3];
  std::memcpy(bits, environmentAt(scene, 1000).wind.data(), sizeof(bits));
  EXPECT_EQ(bits[0], 1078592768u);
  EXPECT_EQ(bits[1], 1053629440u);
  EXPECT_EQ(bits[2], 1069023744u);
}

TEST(Wind, AcceptsShortPeriodsAndLongRuns) {
  Scene scene = gustyScene();
  scene.environment.gust.seconds = 0.01f;
  for (const std::uint64_t tick : {std::uint64_t{0}, std::uint64_t{1} << 40, ~std::uint64_t{0} / 65536}) {
    const Vec3 strayed = environmentAt(scene, tick).wind - scene.environment.wind;
    EXPECT_LE(strayed.cwiseAbs().maxCoeff(), 2);
  }
}

TEST(Wind, AffectsTheStabilityBound) {
  Scene scene = gustyScene();
  Cloth cloth;
  cloth.grid = {.rows = 20, .columns = 20, .width = 1, .height = 1, .pose = {}};
  cloth.mass = 0.01f;
  cloth.drag = 10;
  scene.cloths = {cloth};
  const std::uint32_t gusty = stableSubsteps(scene);
  scene.environment.gust.strength = 4;
  EXPECT_GT(stableSubsteps(scene), gusty);
}

}  // namespace
}  // namespace clothstream::model
