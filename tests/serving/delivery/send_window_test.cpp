// SPDX-License-Identifier: MIT
#include "server/delivery/send_window.h"

#include <chrono>

#include <gtest/gtest.h>

namespace clothstream::delivery {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kRate = 100;

TEST(SendWindow, HoldsTheFramesOfOneRoundTrip) {
  Clock::time_point now = Clock::time_point(std::chrono::hours(1));
  SendWindow window;
  EXPECT_EQ(window.size(kRate), SendWindow::kMin);
  window.send({1, 10, now});
  now += milliseconds(45);
  EXPECT_EQ(window.acknowledge(1, now), 10u);
  EXPECT_EQ(window.size(kRate), SendWindow::kMin + 5);
  window.send({2, 10, now});
  EXPECT_EQ(window.acknowledge(2, now + milliseconds(500)), 10u);
  EXPECT_EQ(window.size(kRate), SendWindow::kMin + 5) << "the minimum counts";
}

TEST(SendWindow, AcknowledgesAllFramesUpToATick) {
  const Clock::time_point now = Clock::time_point(std::chrono::hours(1));
  SendWindow window;
  for (std::uint64_t tick = 1; tick <= 3; ++tick) window.send({tick, tick, now});
  EXPECT_FALSE(window.hasRoom(kRate));
  EXPECT_EQ(window.acknowledge(2, now), 3u);
  EXPECT_EQ(window.size(kRate), SendWindow::kMin + 1) << "two frames at once";
  ASSERT_NE(window.oldest(), nullptr);
  EXPECT_EQ(window.oldest()->tick, 3u);
  EXPECT_FALSE(window.acknowledge(4, now)) << "never sent";
}

TEST(SendWindow, AcceptsLateAcknowledgementsAfterARestart) {
  const Clock::time_point now = Clock::time_point(std::chrono::hours(1));
  SendWindow window;
  window.send({7, 10, now});
  EXPECT_EQ(window.newest(), 7u);
  window.restart();
  EXPECT_EQ(window.newest(), std::nullopt);
  EXPECT_EQ(window.oldest(), nullptr);
  EXPECT_EQ(window.acknowledge(7, now), 0u);
}

}  // namespace
}  // namespace clothstream::delivery
