// SPDX-License-Identifier: MIT
// Subscribers on links that become too slow and recover, in simulated time.
#include "server/delivery/link_adaptation.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "tests/serving/delivery/simulated_link.h"

namespace clothstream::delivery {
namespace {

using namespace schedule;

using namespace std::chrono_literals;

constexpr StreamShape kStream{.rate = 72, .qualities = codec::kMaxQualities};
constexpr std::uint8_t kCoarsest = kStream.qualities - 1;

// Rate of a quality, in bytes/s.
double rateAt(const SimulatedScene& scene, std::uint8_t quality) {
  return scene.fullRate() * std::pow(SimulatedScene::kPartOfFiner, quality);
}

// Advances in steps of 10 ms until `holds` returns true. Returns the time taken, or more than the limit if
// `holds` stays false.
Clock::duration timeUntil(SimulatedScene& scene, const std::function<bool()>& holds, Clock::duration limit) {
  Clock::duration time{};
  for (; !holds() && time <= limit; time += 10ms) scene.pass(10ms);
  return time;
}

std::uint64_t stepsOf(const SimulatedLink& link) {
  return link.metrics.stepsDown.value() + link.metrics.stepsUp.value();
}

TEST(LinkAdaptation, FastLinkGetsTheFullStreamAndNothingElseIsEncoded) {
  SimulatedScene scene(kStream);
  SimulatedLink& link = scene.join();
  scene.pass(20s);
  EXPECT_EQ(link.given, 0);
  EXPECT_EQ(stepsOf(link), 0u);
  // Frames in flight have not arrived yet.
  EXPECT_GE(link.arrived.size() + 2, scene.frames());
  EXPECT_EQ(scene.encoded, (std::array<std::uint64_t, 4>{scene.frames(), 0, 0, 0}));
}

// Throughput of the link from a time on, as a part of the full stream's rate.
class SlowLink : public testing::TestWithParam<double> {};
INSTANTIATE_TEST_SUITE_P(Parts, SlowLink, testing::Values(0.9, 0.7, 0.5, 0.3, 0.2, 0.1),
                         [](const auto& part) { return std::to_string(std::lround(100 * part.param)); });

TEST_P(SlowLink, StepsDownWithinASecondAndRecoversWithinThree) {
  SimulatedScene scene(kStream);
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  for (const Clock::duration slow : {2s, 5s, 30s, 61s}) {
    link.bytesPerSecond = GetParam() * scene.fullRate();
    // On a link that is only slightly too slow, a queue takes a while to build up.
    const Clock::duration limit = GetParam() > 0.7 ? 1s : GetParam() > 0.5 ? 600ms : 500ms;
    const auto isRelieved = [&] {
      return link.given == kCoarsest || rateAt(scene, link.given) <= link.bytesPerSecond;
    };
    const Clock::duration down = timeUntil(scene, isRelieved, limit);
    EXPECT_LE(down, limit);
    scene.pass(slow - down);

    link.bytesPerSecond = 1e9;
    // Permanently: a running attempt may still fail because of the queue.
    Clock::duration up{};
    for (Clock::duration time{}; time <= 3s; time += 10ms) {
      if (link.given != 0) up = time + 10ms;
      scene.pass(10ms);
    }
    EXPECT_LE(up, 3s);
    std::printf("to %.0f %% for %.0f s: down within %.0f ms, up again within %.0f ms\n", 100 * GetParam(),
                seconds(slow), 1000 * seconds(down), 1000 * seconds(up));
    scene.pass(1s);  // the queue has arrived
    const std::size_t before = link.arrived.size();
    scene.pass(2s);
    EXPECT_EQ(link.arrived.size() - before, 144u);
  }
}

TEST_P(SlowLink, DoesNotOscillate) {
  SimulatedScene scene(kStream);
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  link.bytesPerSecond = GetParam() * scene.fullRate();
  scene.pass(5s);
  const std::size_t arrivedBefore = link.arrived.size();
  // Failed attempts: a step up, followed by steps down.
  std::uint64_t attempts = 0;
  bool rises = false;
  std::uint8_t before = link.given;
  for (const Clock::time_point end = scene.now + 60s; scene.now < end; before = link.given) {
    scene.pass(10ms);
    if (link.given == before) continue;
    const bool up = link.given < before;
    attempts += rises && !up;
    rises = up;
  }
  EXPECT_LE(attempts, static_cast<std::uint64_t>(60s / LinkAdaptation::kLongestWait) + 2);
  double bytes = 0;
  Clock::duration oldest{};
  for (std::size_t i = arrivedBefore; i < link.arrived.size(); ++i) {
    bytes += SimulatedScene::kFrameBytes * std::pow(SimulatedScene::kPartOfFiner, link.arrived[i].quality);
    oldest = std::max(oldest, link.arrived[i].age);
  }
  std::printf("of a link of %.0f %%: %.0f %% used, %.1f frames/s, the oldest %.0f ms, %llu attempts\n",
              100 * GetParam(), 100 * bytes / 60 / link.bytesPerSecond,
              static_cast<double>(link.arrived.size() - arrivedBefore) / 60, 1000 * seconds(oldest),
              static_cast<unsigned long long>(attempts));
}

TEST(LinkAdaptation, DeadLinkReturnsAtTheCoarsestQuality) {
  SimulatedScene scene(kStream);
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  link.bytesPerSecond = 0;
  scene.pass(10s);
  // No subscriber receives frames, so nothing is encoded.
  const auto before = scene.encoded;
  scene.pass(5s);
  EXPECT_EQ(scene.encoded, before);
  link.bytesPerSecond = 1e9;
  scene.pass(100ms);
  EXPECT_EQ(link.given, kCoarsest);
  scene.pass(2900ms);
  EXPECT_EQ(link.given, 0);
}

TEST(LinkAdaptation, RecoversWithinThreeSecondsFromTheCoarsestQuality) {
  SimulatedScene scene(kStream);
  SimulatedLink& link = scene.join();
  for (const double part : {0.02, 0.07, 0.12, 0.2}) {
    scene.pass(2s);
    link.bytesPerSecond = part * scene.fullRate();
    scene.pass(20s);
    EXPECT_EQ(link.given, kCoarsest) << part;
    link.bytesPerSecond = 1e9;
    EXPECT_LE(timeUntil(
                  scene, [&] { return link.given == 0; }, 3s),
              3s)
        << part;
  }
}

TEST(LinkAdaptation, SingleDelayChangesNothing) {
  SimulatedScene scene({.rate = 72, .qualities = 3});
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

// A wireless link that sometimes repeats a transmission: one frame in seven and its acknowledgement have a
// latency of up to 35 ms.
TEST(LinkAdaptation, JitterChangesNothing) {
  SimulatedScene scene({.rate = 72, .qualities = 3});
  SimulatedLink& link = scene.join();
  std::minstd_rand random(1);
  for (int i = 0; i < 6000; ++i) {
    link.latency = random() % 7 == 0 ? std::chrono::milliseconds(20 + random() % 16) : 2ms;
    scene.pass(std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1.0 / 72)));
  }
  EXPECT_EQ(stepsOf(link), 0u);
  EXPECT_LE(link.metrics.framesDropped.value(), 6000 / 1000);
}

TEST(LinkAdaptation, SubscribersDoNotInfluenceEachOther) {
  SimulatedScene scene(kStream);
  SimulatedLink& fast = scene.join();
  SimulatedLink& slow = scene.join();
  SimulatedLink& slower = scene.join();
  scene.pass(2s);
  slow.bytesPerSecond = 0.4 * scene.fullRate();
  slower.bytesPerSecond = 0.12 * scene.fullRate();
  scene.pass(30s);
  EXPECT_EQ(fast.given, 0);
  EXPECT_GE(fast.arrived.size() + 2, scene.frames());
  EXPECT_GT(slow.given, 0);
  EXPECT_EQ(slower.given, kCoarsest);
  EXPECT_EQ(std::ranges::count_if(fast.arrived, [](const auto& frame) { return frame.quality > 0; }), 0);
}

TEST(LinkAdaptation, SendsAtMostTheRequestedQuality) {
  SimulatedScene scene(kStream);
  SimulatedLink& link = scene.join(1);
  scene.pass(5s);
  EXPECT_EQ(link.given, 1);
  EXPECT_NEAR(static_cast<double>(link.arrived.size()), 360, 4);
  EXPECT_EQ(scene.encoded[0], 0u);
  link.bytesPerSecond = 0.05 * scene.fullRate();
  scene.pass(5s);
  EXPECT_EQ(link.given, kCoarsest);
  link.bytesPerSecond = 1e9;
  scene.pass(3s);
  EXPECT_EQ(link.given, 1);

  // A requested quality that the stream does not have gives the coarsest one.
  SimulatedScene plain({.rate = 72, .qualities = 2});
  SimulatedLink& coarse = plain.join(3);
  plain.pass(1s);
  EXPECT_EQ(coarse.given, 1);
}

// A stream of 100,000 bytes/s in quality 0 on a link whose rate a controller measures.
TEST(LinkAdaptation, MeasuredRateChoosesTheQuality) {
  LinkAdaptation adaptation(0, kCoarsest);
  Clock::time_point now{1h};
  const auto pass = [&](Clock::duration time, double linkRate) {
    for (const Clock::time_point end = now + time; now < end; now += 10ms) {
      adaptation.made(
          adaptation.quality(),
          static_cast<std::size_t>(1000 * std::pow(LinkAdaptation::kCoarserRate, adaptation.quality())), now);
      adaptation.update(false, now, linkRate);
    }
  };
  pass(2s, 110'000);
  EXPECT_EQ(adaptation.quality(), 0);
  EXPECT_FALSE(adaptation.wantsFiner());
  // The link carries 70,000 bytes/s with the reserve for control messages.
  pass(400ms, 80'000);
  EXPECT_EQ(adaptation.quality(), 1) << "although nothing waits";
  pass(30s, 105'000);
  EXPECT_EQ(adaptation.quality(), 1) << "there are no attempts that would fail";
  EXPECT_TRUE(adaptation.wantsFiner());
  pass(2s, 120'000);
  EXPECT_EQ(adaptation.quality(), 0);
}

TEST(LinkAdaptation, DropsFramesWithOneQuality) {
  SimulatedScene scene({.rate = 72, .qualities = 1});
  SimulatedLink& link = scene.join();
  scene.pass(2s);
  link.bytesPerSecond = 0.3 * scene.fullRate();
  scene.pass(10s);
  EXPECT_EQ(stepsOf(link), 0u);
  EXPECT_GT(link.metrics.framesDropped.value(), 200u);
  EXPECT_GT(link.arrived.size(), 144u + 150u);
}

}  // namespace
}  // namespace clothstream::delivery
