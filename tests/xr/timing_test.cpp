// SPDX-License-Identifier: MIT
#include <array>

#include <gtest/gtest.h>

#include "clients/xr/timing/display_clock.h"
#include "clients/xr/timing/frame_times.h"
#include "clients/xr/timing/refresh_rate.h"

namespace clothstream::xr {
namespace {

constexpr std::int64_t kPeriodNs = 10'000'000;

TEST(XrDisplayClock, UsesTheTimeThatTheRuntimeConverts) {
  EXPECT_EQ(DisplayClock::convertedUs(5'020'000'000, 5'000'000), 5'020'000U);
  EXPECT_EQ(DisplayClock::convertedUs(4'000'000'000, 5'000'000), 5'000'000U) << "not before now";
  EXPECT_EQ(DisplayClock::convertedUs(9'000'000'000, 5'000'000), 5'100'000U) << "a clock that is another one";
}

// The clock of the runtime is an hour ahead, and half of the frames begin late.
TEST(XrDisplayClock, EstimateIsSteadyThoughFramesBeginLate) {
  DisplayClock clock;
  constexpr std::int64_t kAheadNs = 3'600'000'000'000;
  std::uint64_t last = 0;
  for (std::int64_t frame = 0; frame < 200; ++frame) {
    const std::int64_t beginNs = 1'000'000'000 + frame * kPeriodNs;
    const std::int64_t lateNs = frame % 2 == 0 ? 0 : 3'000'000;
    const auto nowUs = static_cast<std::uint64_t>((beginNs + lateNs) / 1000);
    const std::uint64_t shown = clock.displayUs(beginNs + kAheadNs + 15'000'000, kPeriodNs, nowUs);
    EXPECT_GE(shown, nowUs);
    if (frame > 1) {
      EXPECT_EQ(shown - last, static_cast<std::uint64_t>(kPeriodNs / 1000)) << frame;
    }
    last = shown;
  }
}

TEST(XrDisplayClock, ForgetsTheOffsetWhenAClockJumps) {
  DisplayClock clock;
  clock.displayUs(1'000'000'000, kPeriodNs, 1'000'000);
  EXPECT_EQ(clock.displayUs(900'000'000'000, kPeriodNs, 1'010'000), 1'030'000U);
}

TEST(XrDisplayClock, TakesAnUnknownPeriodFor90Hertz) {
  DisplayClock clock;
  EXPECT_EQ(clock.displayUs(1'000'000'000, 0, 500'000), 522'222U);
}

TEST(XrRefreshRate, SuitsTheStream) {
  constexpr std::array<float, 4> kQuest{72, 80, 90, 120};
  EXPECT_EQ(chooseRefreshRate(kQuest, 0, 60, 72), 120);
  EXPECT_EQ(chooseRefreshRate(kQuest, 0, 30, 72), 90);
  EXPECT_EQ(chooseRefreshRate(kQuest, 0, 50, 80), 80) << "nothing suits: it stays";
  EXPECT_EQ(chooseRefreshRate(kQuest, 0, 0, 72), 72) << "the stream is not known yet";
  EXPECT_EQ(chooseRefreshRate(kQuest, 85, 60, 72), 80);
  EXPECT_EQ(chooseRefreshRate({}, 90, 60, 72), 0);
}

TEST(XrFrameTimes, SumsUpTheLastSecond) {
  FrameTimes times;
  for (std::uint64_t i = 1; i <= 300; ++i) times.add(i * 10'000, i == 290 ? 5'000 : 700);
  const FrameTimes::Summary summary = times.summary(3'000'000);
  EXPECT_EQ(summary.frames, 101U);
  EXPECT_NEAR(summary.framesPerSecond, 100, 0.5);
  EXPECT_DOUBLE_EQ(summary.cpuMedianMs, 0.7);
  EXPECT_DOUBLE_EQ(summary.cpuMostMs, 5);
  EXPECT_EQ(times.summary(60'000'000).frames, 0U);
  EXPECT_EQ(times.total(), 300U);
}

}  // namespace
}  // namespace clothstream::xr
