// SPDX-License-Identifier: MIT
#include "server/delivery/cubic_window.h"

#include <cmath>

#include <gtest/gtest.h>

namespace clothstream::delivery {
namespace {

constexpr double kSegment = CubicWindow::kSegment;

// Acknowledges whole windows for a time.
void pass(CubicWindow& window, double time, double roundTrip) {
  for (double t = 0; t < time; t += roundTrip / 10)
    window.acknowledge(window.window() / 10, roundTrip / 10, roundTrip);
}

// RFC 9438, section 4.2: after K the window is that before the reduction.
TEST(CubicWindow, ReturnsToThePlateauAfterK) {
  const double before = 400 * kSegment, roundTrip = 0.1;
  CubicWindow window(before);
  window.reduce();
  EXPECT_DOUBLE_EQ(window.window(), 0.7 * before);
  const double k = std::cbrt(0.3 * 400 / 0.4);
  pass(window, k - 2, roundTrip);
  EXPECT_LT(window.window(), before);
  pass(window, 2, roundTrip);
  EXPECT_NEAR(window.window() / before, 1, 0.01);
  pass(window, 3, roundTrip);
  // 0.4 * 3^3 segments above it.
  EXPECT_NEAR(window.window() - before, 0.4 * 27 * kSegment, 2 * kSegment);
}

// Section 4.3: a small window first recovers with 9 / 17 segments for each round trip, then gains one.
TEST(CubicWindow, GrowsAsRenoWithSmallWindows) {
  CubicWindow window(20 * kSegment);
  window.reduce();
  pass(window, 1, 0.02);
  EXPECT_NEAR(window.window() / kSegment, 20 + 50 - 6 * 17.0 / 9, 1);
}

// Section 4.7: the plateau is below the window at the newest reduction.
TEST(CubicWindow, ReleasesBandwidthForNewFlows) {
  CubicWindow window(1000 * kSegment);
  window.reduce();
  window.reduce();
  EXPECT_NEAR(window.window() / kSegment, 0.49 * 1000, 1e-6);
  pass(window, 5.4, 0.1);
  EXPECT_NEAR(window.window() / kSegment, 0.85 * 700, 5);
}

}  // namespace
}  // namespace clothstream::delivery
