// SPDX-License-Identifier: MIT
// What subscribers get over links that become too slow and recover, in simulated time.
#include "server/stream/link_adaptation.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/stream/simulated_link.h"

namespace clothstream::stream {
namespace {

using namespace std::chrono_literals;

constexpr StreamShape kLayered{.rate = 72, .layers = 3, .qualities = 3};

// Bytes/s of what is sent at a point.
double rateAt(const SimulatedScene& scene, const OperatingPoint& point) {
  return scene.fullRate() * std::pow(SimulatedScene::kPartOfFiner, point.quality) /
         (1 << (kLayered.layers - point.layers));
}

OperatingPoint pointOf(const SimulatedLink& link) {
  return link.told.value_or(OperatingPoint{0, kLayered.layers});
}

std::uint64_t stepsOf(const SimulatedLink& link) {
  return link.metrics.stepsDown.value() + link.metrics.stepsUp.value();
}

TEST(LinkAdaptation, AFastLinkGetsEverythingAndNothingElseIsEncoded) {
  SimulatedScene scene(kLayered);
  SimulatedLink& link = scene.join();
  scene.pass(20s);
  EXPECT_FALSE(link.told);
  EXPECT_EQ(stepsOf(link), 0u);
  // Those on their way are not there yet.
  EXPECT_GE(link.arrived.size() + 2, scene.frames());
  EXPECT_EQ(scene.encoded, (std::array<std::uint64_t, 4>{scene.frames(), 0, 0, 0}));
}

// Of what the whole stream takes, the part that the link carries from a time on.
class SlowLink : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Parts, SlowLink, testing::Values(0.9, 0.7, 0.4, 0.2, 0.1),
                         [](const auto& part) { return std::to_string(std::lround(100 * part.param)); });

TEST_P(SlowLink, GetsWhatItCarriesWithinHalfASecondAndAllAgainWithinThree) {
  SimulatedScene scene(kLayered);
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  for (const Clock::duration slow : {2s, 5s, 30s, 61s}) {
    link.bytesPerSecond = GetParam() * scene.fullRate();
    scene.pass(500ms);
    EXPECT_LE(rateAt(scene, pointOf(link)), link.bytesPerSecond);
    scene.pass(slow - 500ms);

    // From then on frames are as young as the link lets them be: a frame that is too late is left out.
    link.bytesPerSecond = 1e9;
    scene.pass(3s);
    EXPECT_EQ(pointOf(link), (OperatingPoint{0, 3}));
    const std::size_t before = link.arrived.size();
    scene.pass(2s);
    EXPECT_EQ(link.arrived.size() - before, 144u);
  }
}

TEST_P(SlowLink, DoesNotOscillate) {
  SimulatedScene scene(kLayered);
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  link.bytesPerSecond = GetParam() * scene.fullRate();
  scene.pass(5s);
  const std::uint64_t before = stepsOf(link);
  scene.pass(60s);
  // An attempt to go up, and back, after kLongestWait at least.
  const auto attempts = 60s / LinkAdaptation::kLongestWait;
  EXPECT_LE(stepsOf(link) - before, 2u * static_cast<std::uint64_t>(attempts) + 4u);

  // Most of what it carries is used, and what arrives is young.
  const auto isLate = [](const auto& frame) { return frame.age > 500ms; };
  EXPECT_LT(std::ranges::count_if(link.arrived, isLate), static_cast<long>(link.arrived.size() / 50));
}

TEST(LinkAdaptation, ADeadLinkIsAtTheLowestPointWhenItReturns) {
  SimulatedScene scene(kLayered);
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  link.bytesPerSecond = 0;
  scene.pass(10s);
  // Nobody gets anything: nothing is encoded.
  const auto before = scene.encoded;
  scene.pass(5s);
  EXPECT_EQ(scene.encoded, before);
  link.bytesPerSecond = 1e9;
  scene.pass(100ms);
  EXPECT_EQ(pointOf(link), (OperatingPoint{2, 1}));
  scene.pass(2900ms);
  EXPECT_EQ(pointOf(link), (OperatingPoint{0, 3}));
}

TEST(LinkAdaptation, AHiccupChangesNothing) {
  SimulatedScene scene({.rate = 72, .layers = 1, .qualities = 3});
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  for (int i = 0; i < 20; ++i) {
    link.bytesPerSecond = 0;
    scene.pass(60ms);
    link.bytesPerSecond = 1e9;
    scene.pass(940ms);
  }
  EXPECT_EQ(stepsOf(link), 0u);
}

TEST(LinkAdaptation, SubscribersDoNotInfluenceEachOther) {
  SimulatedScene scene(kLayered);
  SimulatedLink& fast = scene.join();
  SimulatedLink& slow = scene.join();
  SimulatedLink& slower = scene.join();
  scene.pass(2s);
  slow.bytesPerSecond = 0.4 * scene.fullRate();
  slower.bytesPerSecond = 0.12 * scene.fullRate();
  scene.pass(30s);
  EXPECT_FALSE(fast.told);
  EXPECT_GE(fast.arrived.size() + 2, scene.frames());
  EXPECT_LT(pointOf(slow).layers, 3);
  EXPECT_EQ(pointOf(slower).layers, 1);
  EXPECT_EQ(std::ranges::count_if(fast.arrived, [](const auto& frame) { return frame.quality > 0; }), 0);
}

TEST(LinkAdaptation, AtMostWhatIsWantedIsSent) {
  SimulatedScene scene(kLayered);
  SimulatedLink& link = scene.join({1, 2});
  scene.pass(5s);
  EXPECT_EQ(pointOf(link), (OperatingPoint{1, 2}));
  EXPECT_NEAR(static_cast<double>(link.arrived.size()), 180, 4);
  EXPECT_EQ(scene.encoded[0], 0u);
  link.bytesPerSecond = 0.05 * scene.fullRate();
  scene.pass(5s);
  EXPECT_EQ(pointOf(link), (OperatingPoint{2, 1}));
  link.bytesPerSecond = 1e9;
  scene.pass(3s);
  EXPECT_EQ(pointOf(link), (OperatingPoint{1, 2}));

  // More than there is: the nearest that there is.
  SimulatedScene plain({.rate = 72, .layers = 1, .qualities = 2});
  SimulatedLink& coarse = plain.join({3, 3});
  plain.pass(1s);
  EXPECT_EQ(pointOf(coarse), (OperatingPoint{1, 1}));
}

TEST(LinkAdaptation, WithOneLayerAndOneQualityFramesAreDroppedAlone) {
  SimulatedScene scene({.rate = 72, .layers = 1, .qualities = 1});
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  link.bytesPerSecond = 0.3 * scene.fullRate();
  scene.pass(10s);
  EXPECT_EQ(stepsOf(link), 0u);
  EXPECT_FALSE(link.told);
  EXPECT_GT(link.metrics.framesDropped.value(), 200u);
  EXPECT_GT(link.arrived.size(), 144u + 150u);
}

}  // namespace
}  // namespace clothstream::stream
