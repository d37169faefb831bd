// SPDX-License-Identifier: MIT
// Free ranges of a block: taken without overlap, given back without loss.
#include "server/vulkan/free_ranges.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::vulkan {
namespace {

TEST(FreeRanges, OffsetsAreAligned) {
  FreeRanges ranges(1024);
  EXPECT_EQ(ranges.take(10, 1), 0u);
  EXPECT_EQ(ranges.take(10, 64), 64u);
  EXPECT_EQ(ranges.take(256, 256), 256u);
  EXPECT_EQ(ranges.take(50, 1), 10u) << "what alignment skipped is free";
}

TEST(FreeRanges, RefusesWhatHasNoRoom) {
  FreeRanges ranges(100);
  EXPECT_EQ(ranges.take(101, 1), std::nullopt);
  EXPECT_EQ(ranges.take(100, 1), 0u);
  EXPECT_EQ(ranges.take(1, 1), std::nullopt);
  ranges.giveBack(10, 50);
  EXPECT_EQ(ranges.take(40, 32), std::nullopt) << "from 32 on there are 28";
  EXPECT_EQ(ranges.take(28, 32), 32u);
}

TEST(FreeRanges, NeighboursBecomeOneRange) {
  for (const std::vector<std::uint64_t>& order :
       {std::vector<std::uint64_t>{0, 10, 20}, {20, 10, 0}, {0, 20, 10}, {10, 0, 20}}) {
    FreeRanges ranges(30);
    for (const std::uint64_t offset : {0u, 10u, 20u}) ASSERT_EQ(ranges.take(10, 1), offset);
    EXPECT_FALSE(ranges.allFree());
    for (const std::uint64_t offset : order) ranges.giveBack(offset, 10);
    EXPECT_TRUE(ranges.allFree());
    EXPECT_EQ(ranges.take(30, 1), 0u);
  }
}

TEST(FreeRanges, PrefersTheSmallestWithRoom) {
  FreeRanges ranges(100);
  ASSERT_EQ(ranges.take(100, 1), 0u);
  ranges.giveBack(10, 30);
  ranges.giveBack(50, 20);
  EXPECT_EQ(ranges.take(15, 1), 50u);
  EXPECT_EQ(ranges.take(15, 1), 10u);
}

// The same ranges as bytes that are taken or free.
class Bytes {
 public:
  explicit Bytes(std::size_t count) : taken_(count) {}

  // True if a range with this size and alignment is free.
  bool hasRoom(std::size_t bytes, std::size_t alignment) const {
    for (std::size_t offset = 0; offset + bytes <= taken_.size(); offset += alignment)
      if (isFree(offset, bytes)) return true;
    return false;
  }
  bool isFree(std::size_t offset, std::size_t bytes) const {
    return offset + bytes <= taken_.size() &&
           std::none_of(at(offset), at(offset + bytes), [](bool is) { return is; });
  }
  void set(std::size_t offset, std::size_t bytes, bool taken) {
    for (std::size_t i = 0; i < bytes; ++i) taken_[offset + i] = taken;
  }

 private:
  std::vector<bool>::const_iterator at(std::size_t offset) const {
    return taken_.begin() + static_cast<std::ptrdiff_t>(offset);
  }

  std::vector<bool> taken_;
};

TEST(FreeRanges, AgreesWithAModelAtRandom) {
  constexpr std::size_t kBytes = 600;
  std::mt19937 random(7);
  const auto below = [&](std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random);
  };
  FreeRanges ranges(kBytes);
  Bytes model(kBytes);
  struct Range {
    std::size_t offset, bytes;
  };
  std::vector<Range> live;
  for (int step = 0; step < 4000; ++step) {
    if (live.empty() || below(5) > 1) {
      const std::size_t bytes = 1 + below(40), alignment = std::size_t{1} << below(6);
      const std::optional<std::uint64_t> offset = ranges.take(bytes, alignment);
      ASSERT_EQ(offset.has_value(), model.hasRoom(bytes, alignment)) << step;
      if (!offset) continue;
      ASSERT_EQ(*offset % alignment, 0u) << step;
      ASSERT_TRUE(model.isFree(*offset, bytes)) << step;
      model.set(*offset, bytes, true);
      live.push_back({*offset, bytes});
    } else {
      std::swap(live[below(live.size())], live.back());
      ranges.giveBack(live.back().offset, live.back().bytes);
      model.set(live.back().offset, live.back().bytes, false);
      live.pop_back();
    }
    ASSERT_EQ(ranges.allFree(), live.empty()) << step;
  }
}

}  // namespace
}  // namespace clothstream::vulkan
