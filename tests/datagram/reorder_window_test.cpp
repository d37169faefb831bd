// SPDX-License-Identifier: MIT
// The wait for packets that others have overtaken.
#include "proto/datagram/reorder_window.h"

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::datagram {
namespace {

// Adds packets that leave every 2 ms, with an even jitter.
void addPackets(ReorderWindow& window, std::uint32_t first, std::uint32_t count, double jitterUs,
                double loss) {
  std::mt19937 random(1);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> arrivals;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (std::bernoulli_distribution(loss)(random)) continue;
    const double late = std::uniform_real_distribution(0.0, std::max(jitterUs, 1e-9))(random);
    arrivals.emplace_back(static_cast<std::uint64_t>(2'000.0 * i + late), first + i);
  }
  std::ranges::sort(arrivals);
  for (const auto& [us, packet] : arrivals) window.add(packet, us);
}

TEST(ReorderWindow, IsZeroWhereOrderIsKept) {
  ReorderWindow window;
  addPackets(window, 0, 2'000, 0, 0.1);
  EXPECT_EQ(window.us(), 0u);
}

TEST(ReorderWindow, CoversMostOfTheJitter) {
  ReorderWindow window;
  addPackets(window, 0xfffff000, 8'000, 12'000, 0.02);
  EXPECT_GT(window.us(), 7'000u);
  EXPECT_LE(window.us(), 12'000u);
}

TEST(ReorderWindow, ShrinksWhenOrderReturns) {
  ReorderWindow window;
  addPackets(window, 0, 4'000, 12'000, 0);
  const std::uint64_t before = window.us();
  addPackets(window, 4'000, 10'000, 0, 0);
  EXPECT_LT(window.us(), before / 50);
}

TEST(ReorderWindow, NeverExceedsItsBound) {
  ReorderWindow window;
  addPackets(window, 0, 4'000, 400'000, 0);
  EXPECT_LE(window.us(), static_cast<std::uint64_t>(ReorderWindow::kMaxUs));
}

}  // namespace
}  // namespace clothstream::datagram
