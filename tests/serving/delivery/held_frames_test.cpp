// SPDX-License-Identifier: MIT
#include "server/delivery/held_frames.h"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::delivery {
namespace {

PublishedFrame frame(std::uint64_t tick, bool key = false, std::size_t bytes = 100) {
  return {.message = std::make_shared<std::vector<std::byte>>(bytes),
          .tick = tick,
          .key = key,
          .referenceTick = tick - 1};
}

TEST(HeldFrames, RefusesFramesWithoutTheirReference) {
  HeldFrames held;
  EXPECT_FALSE(held.add(frame(1)).held) << "a stream begins with a key frame";
  EXPECT_TRUE(held.add(frame(2, true)).held);
  EXPECT_EQ(held.take().tick, 2u);
  EXPECT_TRUE(held.add(frame(3)).held) << "its reference was taken";
  EXPECT_FALSE(held.add(frame(5)).held);
  EXPECT_FALSE(held.add(frame(4)).held) << "only a key frame continues after a gap";
  EXPECT_TRUE(held.needsKey());
  EXPECT_EQ(held.front().tick, 3u) << "frames before the gap stay";
}

TEST(HeldFrames, DropsEverythingWithoutRoom) {
  HeldFrames held;
  for (std::uint64_t tick = 1; tick <= HeldFrames::kMax; ++tick) held.add(frame(tick, tick == 1));
  const HeldFrames::Added added = held.add(frame(HeldFrames::kMax + 1));
  EXPECT_TRUE(added.overflowed);
  EXPECT_EQ(added.dropped, HeldFrames::kMax + 1);
  EXPECT_TRUE(held.empty());
  EXPECT_TRUE(held.add(frame(10, true, 2 * HeldFrames::kMaxBytes)).held) << "one frame may be larger";
  EXPECT_TRUE(held.add(frame(11)).overflowed);
}

TEST(HeldFrames, KeyFrameReplacesOlderFrames) {
  HeldFrames held;
  held.add(frame(1, true));
  held.add(frame(2));
  EXPECT_EQ(held.add(frame(3, true)).dropped, 2u);
  EXPECT_EQ(held.take().tick, 3u);
  EXPECT_TRUE(held.empty());
}

}  // namespace
}  // namespace clothstream::delivery
