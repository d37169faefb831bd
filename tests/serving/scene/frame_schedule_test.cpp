// SPDX-License-Identifier: MIT
// Frames, reports and key frames of ticks.
#include "server/scene/frame_schedule.h"

#include <chrono>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::scene {
namespace {

const Clock::time_point kStart{std::chrono::hours(1)};

TEST(FrameSchedule, FramesAndReportsFollowTheRates) {
  FrameSchedule schedule(240, 60, 7);  // a frame every 4 ticks, a report after at least 35
  std::vector<std::uint64_t> frames, reports;
  for (std::uint64_t tick = 1; tick <= 80; ++tick) {
    if (!schedule.takeFrame(tick, tick <= 40 ? 1 : 4)) continue;
    frames.push_back(tick);
    if (schedule.takeReport(tick)) reports.push_back(tick);
  }
  EXPECT_EQ(frames, (std::vector<std::uint64_t>{4, 8, 12, 16, 20, 24, 28, 32, 36, 40, 48, 64, 80}));
  EXPECT_EQ(reports, (std::vector<std::uint64_t>{4, 40, 80}));
}

TEST(FrameSchedule, NoReportsAtRateZero) {
  FrameSchedule schedule(60, 60, 0);
  EXPECT_TRUE(schedule.takeFrame(1, 1));
  EXPECT_FALSE(schedule.takeReport(1));
}

TEST(FrameSchedule, OwesUntilTheNextFrame) {
  FrameSchedule schedule(120, 60, 0);
  schedule.owe();
  EXPECT_FALSE(schedule.takeFrame(3, 1));
  EXPECT_TRUE(schedule.owes());
  EXPECT_TRUE(schedule.takeFrame(4, 1));
  EXPECT_FALSE(schedule.owes());
}

TEST(FrameSchedule, RequestedKeyFramesHaveAnInterval) {
  FrameSchedule schedule(60, 60, 0);
  EXPECT_FALSE(schedule.needsKey(1, false, false, kStart));
  EXPECT_TRUE(schedule.needsKey(1, true, false, kStart));
  schedule.made(1 << 1, kStart);
  const Clock::time_point next = kStart + FrameSchedule::kKeyFrameInterval;
  EXPECT_FALSE(schedule.needsKey(1, true, false, next - std::chrono::milliseconds(1)));
  EXPECT_TRUE(schedule.needsKey(0, true, false, next - std::chrono::milliseconds(1)));
  EXPECT_TRUE(schedule.needsKey(1, true, false, next));
  schedule.madePaused(1 << 1, next);
  EXPECT_FALSE(schedule.needsKey(1, true, false, next));
}

TEST(FrameSchedule, RecordingsHaveFrequentKeyFrames) {
  FrameSchedule schedule(60, 60, 0);
  schedule.made(1, kStart);
  schedule.beginRecording();
  std::vector<int> keys;
  for (int frame = 0; frame < 50; ++frame) {
    const bool key = schedule.needsKey(0, false, true, kStart);
    EXPECT_FALSE(schedule.needsKey(0, false, false, kStart)) << "not recorded";
    EXPECT_FALSE(schedule.needsKey(1, false, true, kStart)) << "only the finest quality is recorded";
    if (key) keys.push_back(frame);
    // A paused scene's key frame is not in the recording.
    schedule.madePaused(1, kStart);
    schedule.made(key ? 1 : 0, kStart);
  }
  EXPECT_EQ(keys, (std::vector<int>{0, 24, 48}));
}

}  // namespace
}  // namespace clothstream::scene
