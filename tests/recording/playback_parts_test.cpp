// SPDX-License-Identifier: MIT
// Times and ticks of a playback, without a recording.
#include <chrono>
#include <cstdint>
#include <optional>

#include <gtest/gtest.h>

#include "server/recording/announcement_times.h"
#include "server/recording/fault_gate.h"
#include "server/recording/pace.h"
#include "server/recording/tick_numbering.h"

namespace clothstream::recording {
namespace {

using namespace std::chrono_literals;
using Clock = schedule::Clock;

constexpr Clock::time_point kNow(1h);

TEST(TickNumberingTest, SentTicksAlwaysIncrease) {
  TickNumbering ticks(4);
  ticks.restart(100);
  EXPECT_EQ(ticks.shifted(100), 100U);
  ticks.send(100);
  ticks.restart(20);  // a seek
  EXPECT_EQ(ticks.shifted(20), 104U);
  ticks.send(104);
  ticks.follow(24);
  EXPECT_EQ(ticks.shifted(24), 108U);
  ticks.send(108);
  for (const std::uint64_t recorded : {std::uint64_t{1}, 25 + kMaxTickStep}) {
    TickNumbering other = ticks;
    other.follow(recorded);
    EXPECT_EQ(other.shifted(recorded), 112U);
  }
}

TEST(TickNumberingTest, HugeFirstTicksAreRenumbered) {
  TickNumbering ticks(4);
  ticks.restart(~std::uint64_t{0});
  EXPECT_EQ(ticks.shifted(~std::uint64_t{0}), 4U);
}

TEST(PaceTest, LongDelaysMoveWhatFollows) {
  Pace pace;
  pace.start(10, kNow);
  EXPECT_EQ(pace.due(12, 2), kNow + 1s);
  EXPECT_FALSE(pace.reaches(12, 2, kNow + 999ms));
  EXPECT_TRUE(pace.reaches(12, 2, kNow + 1200ms));
  EXPECT_EQ(pace.due(12, 2), kNow + 1s);
  EXPECT_TRUE(pace.reaches(12, 2, kNow + 3s));
  EXPECT_EQ(pace.due(12, 2), kNow + 2750ms);
}

TEST(FaultGateTest, AHeldFramePassesOnce) {
  constexpr std::uint32_t kSeed = 7;
  std::uint64_t tick = 0;
  while (FaultPlan(kSeed).at(tick).kind != Fault::Kind::delay) ++tick;
  FaultGate gate(kSeed);
  EXPECT_EQ(gate.passageOf(tick, kNow, "", 0), FaultGate::Passage::held);
  EXPECT_EQ(gate.heldUntil(), kNow + FaultPlan(kSeed).at(tick).wait);
  EXPECT_EQ(gate.passageOf(tick, kNow + 1s, "", 0), FaultGate::Passage::free);
  EXPECT_FALSE(gate.heldUntil());
  EXPECT_EQ(gate.takeStart(kNow + 1s), kNow);
  EXPECT_EQ(gate.takeStart(kNow + 1s), kNow + 1s);
  EXPECT_EQ(FaultGate(std::nullopt).passageOf(tick, kNow, "", 0), FaultGate::Passage::free);
}

TEST(AnnouncementTimesTest, LockstepFollowsTheRecording) {
  AnnouncementTimes lockstep(true), paced(false);
  lockstep.announced(0.9, kNow);
  paced.announced(0.9, kNow);
  EXPECT_TRUE(lockstep.isDue(1.1, true, kNow));
  EXPECT_FALSE(lockstep.isDue(1.1, false, kNow));
  EXPECT_FALSE(paced.isDue(1.1, true, kNow));
  EXPECT_TRUE(paced.isDue(1.1, true, kNow + 1s));
  paced.request();
  EXPECT_TRUE(paced.isDue(0.9, false, kNow));
}

}  // namespace
}  // namespace clothstream::recording
