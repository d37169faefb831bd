// SPDX-License-Identifier: MIT
// Messages of an origin on their way to a peer of an edge: which ones leave by the link, in which order.
#include "server/fleet/relayed_messages.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"

namespace clothstream::fleet {
namespace {

using delivery::SharedBytes;

constexpr RelayedMessages::Link kRoom{.hasRoom = true, .frameRate = 1e6}, kNoRoom{};

// A frame of this tick whose packet has about this length. A predicted one refers to the tick before.
SharedBytes frame(std::uint64_t tick, bool key = false, std::uint32_t bytes = 100) {
  codec::PacketHeader header;
  header.kind = key ? codec::PacketKind::key : codec::PacketKind::predicted;
  header.tick = tick;
  header.referenceCount = key ? 0 : 1;
  header.references[0] = tick - 1;
  header.rangeCount = 1;
  header.ranges[0] = {0, 1};
  header.sectionCount = 1;
  header.sectionBytes[0] = bytes;
  std::vector<std::byte> packet(codec::headerBound(header));
  packet.resize(codec::writeHeader(header, packet) + bytes);
  return delivery::serialiseFrame(v1::Frame(), packet);
}

class RelayedMessagesTest : public ::testing::Test {
 protected:
  SharedBytes add(SharedBytes message) {
    messages.add(message, ++sequence);
    return message;
  }
  SharedBytes notice() { return add(delivery::notice(v1::NOTICE_KIND_SCENE_PAUSED, "", 0)); }
  // Frames leave by the link from now on.
  void useLink() {
    messages.setLink(kRoom);
    messages.acknowledge(1);
  }

  RelayedMessages messages;
  std::uint64_t sequence = 0;
};

TEST_F(RelayedMessagesTest, StreamKeepsOrder) {
  const auto first = notice(), second = add(frame(1, true)), third = notice();
  EXPECT_FALSE(messages.hasNextFrame());
  EXPECT_EQ(messages.next(), first);
  EXPECT_EQ(messages.next(), second);
  EXPECT_EQ(messages.next(), third);
  EXPECT_EQ(messages.next(), nullptr);
}

TEST_F(RelayedMessagesTest, LinkWaitsForAcknowledgement) {
  messages.setLink(kRoom);
  add(frame(1, true));
  EXPECT_EQ(messages.nextFrame(), nullptr);
  EXPECT_NE(messages.next(), nullptr);
  messages.acknowledge(1);
  const auto second = add(frame(2));
  EXPECT_FALSE(messages.hasNext());
  EXPECT_EQ(messages.nextFrame(), second);
}

TEST_F(RelayedMessagesTest, OtherMessagesOvertakeFrames) {
  useLink();
  messages.setLink(kNoRoom);
  const auto held = add(frame(2));
  const auto other = notice();
  EXPECT_EQ(messages.next(), other);
  EXPECT_EQ(messages.nextFrame(), nullptr);
  messages.setLink(kRoom);
  EXPECT_EQ(messages.nextFrame(), held);
}

TEST_F(RelayedMessagesTest, LongFrameLeavesByStreamInOrder) {
  useLink();
  const auto before = add(frame(2)), tooLong = add(frame(3, true, 150'000)), after = add(frame(4));
  EXPECT_FALSE(messages.hasNext());
  EXPECT_EQ(messages.nextFrame(), before);
  EXPECT_EQ(messages.nextFrame(), nullptr);
  EXPECT_EQ(messages.next(), tooLong);
  EXPECT_EQ(messages.next(), nullptr);
  EXPECT_EQ(messages.nextFrame(), after);
}

TEST_F(RelayedMessagesTest, LostLinkNeedsKeyFrame) {
  useLink();
  add(frame(2));
  add(frame(3));
  EXPECT_NE(messages.nextFrame(), nullptr);
  messages.setLink(std::nullopt);
  EXPECT_TRUE(messages.needsKeyFrame());
  add(frame(4));
  EXPECT_FALSE(messages.hasNext()) << "its reference may be lost";
  const auto key = add(frame(5, true)), next = add(frame(6));
  EXPECT_FALSE(messages.needsKeyFrame());
  EXPECT_EQ(messages.next(), key);
  EXPECT_EQ(messages.next(), next);
}

TEST_F(RelayedMessagesTest, AcknowledgedFramesNeedNoKeyFrame) {
  useLink();
  add(frame(2));
  EXPECT_NE(messages.nextFrame(), nullptr);
  messages.acknowledge(2);
  messages.setLink(kNoRoom);
  const auto held = add(frame(3));
  messages.setLink(std::nullopt);
  EXPECT_FALSE(messages.needsKeyFrame());
  const auto other = notice();
  EXPECT_EQ(messages.next(), held);
  EXPECT_EQ(messages.next(), other);
}

// The origin sends more when the oldest message has left, by whichever way.
TEST_F(RelayedMessagesTest, OldestMessageHoldsUpChannel) {
  useLink();
  notice();
  add(frame(2));
  notice();
  EXPECT_EQ(messages.taken(), 0u);
  EXPECT_NE(messages.nextFrame(), nullptr);
  EXPECT_EQ(messages.taken(), 0u);
  EXPECT_NE(messages.next(), nullptr);
  EXPECT_EQ(messages.taken(), 2u);
  messages.add(delivery::notice(v1::NOTICE_KIND_SCENE_PAUSED, "", 0));
  EXPECT_NE(messages.next(), nullptr);
  EXPECT_EQ(messages.taken(), 3u);
  messages.forgetChannel();
  EXPECT_EQ(messages.taken(), 0u);
}

}  // namespace
}  // namespace clothstream::fleet
