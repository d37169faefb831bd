// SPDX-License-Identifier: MIT
// Playback in lockstep and with faults: what subscribers receive depends on acknowledgements, not on time.
#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/recording/fault_plan.h"
#include "server/recording/playback.h"
#include "tests/recording/sample.h"
#include "tests/recording/viewer.h"

namespace clothstream::recording {
namespace {

using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::Ne;
using ::testing::SizeIs;

constexpr PlaybackOptions kUnpacedLockstep{.speed = kUnpaced, .lockstep = true};

class LockstepTest : public ::testing::Test {
 protected:
  void play(const PlaybackOptions& options) {
    playback = std::make_shared<Playback>(streamOf(sampleRecording(kSampleFrames)), options);
    scene = std::make_unique<scene::LiveScene>("sample", playback);
  }
  Viewer& join() { return *viewers.emplace_back(std::make_unique<Viewer>(*scene)); }
  // One step of the player, at the same time as the one before.
  void step() {
    playback->step(*scene, now);
    for (const auto& viewer : viewers) viewer->read(now);
  }
  void stepOften() {
    for (std::uint32_t i = 0; i < 2 * kSampleFrames; ++i) step();
  }
  // Plays to the end, and lets time pass only while a fault holds a frame. Returns the ticks of the frames.
  std::vector<std::uint64_t> ticksToTheEnd() {
    Viewer& viewer = join();
    for (int steps = 0; !scene->paused && steps < 10'000; ++steps) {
      const auto next = playback->step(*scene, now);
      viewer.read(now);
      if (next) now = std::max(now, *next);
    }
    std::vector<std::uint64_t> ticks;
    for (const Seen& frame : viewer.frames) ticks.push_back(frame.tick);
    return ticks;
  }

  std::shared_ptr<Playback> playback;
  std::unique_ptr<scene::LiveScene> scene;
  std::vector<std::unique_ptr<Viewer>> viewers;
  Clock::time_point now = Clock::now();
};

TEST_F(LockstepTest, SendsEveryFrameOnceWithoutWaitingForTheClock) {
  play(kUnpacedLockstep);
  const Viewer& viewer = join();
  stepOften();
  ASSERT_THAT(viewer.frames, SizeIs(kSampleFrames));
  for (std::size_t i = 0; i < kSampleFrames; ++i) EXPECT_EQ(viewer.frames[i].tick, i + 1);
  EXPECT_TRUE(scene->paused);
  EXPECT_THAT(viewer.notices.back().text(), HasSubstr("at its end"));
  EXPECT_EQ(scene->metrics.framesDropped.value(), 0u);
}

TEST_F(LockstepTest, WaitsForEachAcknowledgement) {
  play(kUnpacedLockstep);
  Viewer& viewer = join();
  viewer.acknowledges = false;
  for (std::size_t frames = 1; frames <= 5; ++frames) {
    now += seconds(10);
    stepOften();
    ASSERT_THAT(viewer.frames, SizeIs(frames));
    viewer.acknowledge(now);
  }
}

TEST_F(LockstepTest, WaitsForEverySubscriber) {
  play({.speed = kUnpaced, .lockstep = true, .waitFor = 2});
  const Viewer& first = join();
  stepOften();
  EXPECT_THAT(first.frames, SizeIs(0));
  Viewer& slow = join();
  slow.acknowledges = false;
  stepOften();
  ASSERT_THAT(first.frames, SizeIs(1));
  ASSERT_THAT(slow.frames, SizeIs(1));
  slow.acknowledges = true;
  slow.acknowledge(now);
  stepOften();
  EXPECT_THAT(first.frames, SizeIs(kSampleFrames));
  EXPECT_THAT(slow.frames, SizeIs(kSampleFrames));
}

TEST_F(LockstepTest, ContinuesWithoutASubscriberThatLeaves) {
  play({.speed = kUnpaced, .lockstep = true, .waitFor = 2});
  const Viewer& stays = join();
  join().acknowledges = false;
  stepOften();
  ASSERT_THAT(stays.frames, SizeIs(1));
  viewers.pop_back();
  stepOften();
  EXPECT_THAT(stays.frames, SizeIs(kSampleFrames));
}

TEST_F(LockstepTest, PacesByTheClockAtOtherSpeeds) {
  play({.speed = 2, .lockstep = true});
  const Viewer& viewer = join();
  step();
  for (int i = 0; i < 500; ++i) {
    now += seconds(0.001);
    step();
  }
  EXPECT_NEAR(static_cast<double>(viewer.frames.size()), 2 * 0.5 * kSampleRate, 2);
  v1::ControlSceneRequest unpaced;
  unpaced.set_speed(kUnpaced);
  ASSERT_TRUE(playback->control(unpaced));
  stepOften();
  EXPECT_THAT(viewer.frames, SizeIs(kSampleFrames));
}

TEST_F(LockstepTest, IsRequiredForPlayingWithoutPace) {
  play({});
  v1::ControlSceneRequest unpaced;
  unpaced.set_speed(kUnpaced);
  const auto refused = playback->control(unpaced);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("speed = 0: must be 0.1 to 8"));
}

TEST_F(LockstepTest, StopsWhilePausedAndContinuesAfterASeek) {
  play(kUnpacedLockstep);
  Viewer& viewer = join();
  viewer.acknowledges = false;
  step();
  viewer.acknowledge(now);
  scene->paused = true;
  stepOften();
  ASSERT_THAT(viewer.frames, SizeIs(1));
  v1::ControlSceneRequest request;
  request.set_seek(1);
  ASSERT_TRUE(playback->control(request));
  stepOften();
  ASSERT_THAT(viewer.frames, SizeIs(2));  // the key frame there, which is shown
  EXPECT_TRUE(viewer.frames.back().key);
  viewer.acknowledge(now);
  viewer.acknowledges = true;
  scene->paused = false;
  stepOften();
  EXPECT_GT(viewer.frames.size(), kSampleFrames - kSampleRate);
  EXPECT_LT(viewer.frames.size(), kSampleFrames);
}

TEST_F(LockstepTest, AnnouncesThePositionOncePerRecordedSecond) {
  play(kUnpacedLockstep);
  const Viewer& viewer = join();
  stepOften();
  std::vector<double> positions;
  for (const v1::Playback& announced : viewer.playbacks) positions.push_back(announced.position());
  EXPECT_THAT(positions, ::testing::ElementsAre(
                             ::testing::DoubleNear(0, 1e-6), ::testing::DoubleNear(1, 0.02),
                             ::testing::DoubleNear(2, 0.02), ::testing::DoubleNear(149.0 / 60, 1e-6)));
  EXPECT_THAT(viewer.playbacks.front().speed(), 0);
}

TEST_F(LockstepTest, KeepsAllFramesForASlowSubscriber) {
  play(kUnpacedLockstep);
  Viewer& viewer = join();
  viewer.acknowledges = false;
  for (std::size_t frames = 1; frames <= 30; ++frames) {
    now += seconds(1);
    step();
    step();
    ASSERT_THAT(viewer.frames, SizeIs(frames));
    viewer.acknowledge(now);
  }
}

class Faults : public LockstepTest {
 protected:
  std::vector<std::uint64_t> ticksWith(std::uint32_t seed) {
    viewers.clear();
    play({.speed = kUnpaced, .lockstep = true, .faults = seed});
    return ticksToTheEnd();
  }
};

TEST_F(Faults, AreTheSameForTheSameSeed) {
  const std::vector<std::uint64_t> ticks = ticksWith(7);
  EXPECT_LT(ticks.size(), kSampleFrames);
  EXPECT_GT(ticks.size(), kSampleFrames / 4);
  EXPECT_TRUE(std::ranges::is_sorted(ticks));
  EXPECT_EQ(ticksWith(7), ticks);
  EXPECT_NE(ticksWith(8), ticks);
}

TEST_F(Faults, DropNoFrameTwice) {
  const std::vector<std::uint64_t> ticks = ticksWith(7);
  // At the end, a subscriber that lost the last frames keeps what it has.
  stepOften();
  EXPECT_EQ(viewers.front()->frames.size(), ticks.size());
}

TEST_F(Faults, HoldADelayedFrameForItsTime) {
  std::uint32_t seed = 0;
  while (FaultPlan(seed).at(2).kind != Fault::Kind::delay) ++seed;  // the second frame
  play({.speed = kUnpaced, .lockstep = true, .faults = seed});
  const Viewer& viewer = join();
  stepOften();
  ASSERT_THAT(viewer.frames, SizeIs(1));
  now += FaultPlan(seed).at(2).wait;
  step();
  EXPECT_GE(viewer.frames.size(), 2u);
}

TEST(FaultPlan, IsTheSameOnEveryMachine) {
  const FaultPlan plan(1);
  std::map<std::uint64_t, Fault> first;
  for (std::uint64_t tick = 1; first.size() < 4; ++tick)
    if (const Fault fault = plan.at(tick); fault.kind != Fault::Kind::none) first[tick] = fault;
  std::string text;
  for (const auto& [tick, fault] : first)
    text += std::to_string(tick) + ":" + std::to_string(static_cast<int>(fault.kind)) + ":" +
            std::to_string(fault.wait.count()) + " ";
  EXPECT_EQ(text, "10:3:419 57:2:29 74:3:452 102:2:34 ");
}

TEST(FaultPlan, HasTheDocumentedRatesAndTimes) {
  constexpr int kFrames = 50'000;
  std::map<Fault::Kind, int> counts;
  const FaultPlan plan(3);
  for (std::uint64_t tick = 1; tick <= kFrames; ++tick) {
    const Fault fault = plan.at(tick);
    ++counts[fault.kind];
    const auto shortest = fault.kind == Fault::Kind::delay ? kShortestDelay : kShortestStall;
    const auto longest = fault.kind == Fault::Kind::delay ? kLongestDelay : kLongestStall;
    if (fault.kind != Fault::Kind::delay && fault.kind != Fault::Kind::stall) continue;
    EXPECT_GE(fault.wait, shortest);
    EXPECT_LE(fault.wait, longest);
  }
  EXPECT_NEAR(1000.0 * counts[Fault::Kind::drop] / kFrames, kDropsIn1000, 2);
  EXPECT_NEAR(1000.0 * counts[Fault::Kind::delay] / kFrames, kDelaysIn1000, 3);
  EXPECT_NEAR(1000.0 * counts[Fault::Kind::stall] / kFrames, kStallsIn1000, 1);
}

}  // namespace
}  // namespace clothstream::recording
