// SPDX-License-Identifier: MIT
// Numbers of received and of sent messages. All begin shortly before the numbers wrap around.
#include <gtest/gtest.h>

#include "proto/sctp/received_tsns.h"
#include "proto/sctp/sent_tsns.h"
#include "tests/sctp/bytes.h"

namespace clothstream::sctp {
namespace {

using namespace std::chrono_literals;
using Arrival = ReceivedTsns::Arrival;

constexpr std::uint32_t kFirst = 0xfffffffe;
constexpr std::uint32_t kBefore = kFirst - 1;

std::vector<GapBlock> blocksOf(const ReceivedTsns& tsns) {
  ReceivedTsns::GapBlocks blocks;
  const auto written = tsns.gapBlocks(blocks);
  return {written.begin(), written.end()};
}

TEST(ReceivedTsns, CountUpInOrder) {
  ReceivedTsns tsns(kFirst);
  EXPECT_EQ(tsns.cumulative(), kBefore);
  for (std::uint32_t i = 0; i < 3000; ++i) {
    EXPECT_EQ(tsns.add(kFirst + i), Arrival::isNew);
    EXPECT_EQ(tsns.cumulative(), kFirst + i);
    EXPECT_FALSE(tsns.hasGaps());
  }
}

TEST(ReceivedTsns, GapsCloseWhenFilled) {
  ReceivedTsns tsns(kFirst);
  for (const std::uint32_t i : {2u, 3u, 5u}) EXPECT_EQ(tsns.add(kFirst + i), Arrival::isNew);
  EXPECT_EQ(tsns.cumulative(), kBefore);
  EXPECT_TRUE(tsns.hasGaps());
  EXPECT_EQ(blocksOf(tsns), (std::vector<GapBlock>{{3, 4}, {6, 6}}));
  tsns.add(kFirst);
  EXPECT_EQ(blocksOf(tsns), (std::vector<GapBlock>{{2, 3}, {5, 5}}));
  tsns.add(kFirst + 1);
  EXPECT_EQ(blocksOf(tsns), (std::vector<GapBlock>{{2, 2}}));
  tsns.add(kFirst + 4);
  EXPECT_FALSE(tsns.hasGaps());
  EXPECT_EQ(tsns.cumulative(), kFirst + 5);
  EXPECT_TRUE(blocksOf(tsns).empty());
}

TEST(ReceivedTsns, DuplicatesAreSeen) {
  ReceivedTsns tsns(kFirst);
  tsns.add(kFirst);
  tsns.add(kFirst + 2);
  EXPECT_EQ(tsns.add(kFirst), Arrival::duplicate);
  EXPECT_EQ(tsns.add(kFirst + 2), Arrival::duplicate);
  EXPECT_EQ(tsns.add(kBefore - 5), Arrival::duplicate);
}

TEST(ReceivedTsns, FarAheadIsNotTaken) {
  ReceivedTsns tsns(kFirst);
  EXPECT_EQ(tsns.add(kBefore + ReceivedTsns::kWindow + 1), Arrival::tooFar);
  EXPECT_FALSE(tsns.hasGaps());
  EXPECT_EQ(tsns.add(kBefore + ReceivedTsns::kWindow), Arrival::isNew);
  EXPECT_EQ(blocksOf(tsns), (std::vector<GapBlock>{{1024, 1024}}));
}

TEST(ReceivedTsns, SkippingClosesGaps) {
  ReceivedTsns tsns(kFirst);
  for (const std::uint32_t i : {1u, 4u, 5u, 8u}) tsns.add(kFirst + i);
  EXPECT_TRUE(tsns.skipTo(kFirst + 3));
  EXPECT_EQ(tsns.cumulative(), kFirst + 5);
  EXPECT_EQ(tsns.add(kFirst + 2), Arrival::duplicate);
  EXPECT_EQ(blocksOf(tsns), (std::vector<GapBlock>{{3, 3}}));
  EXPECT_FALSE(tsns.skipTo(kFirst + 5));
  EXPECT_FALSE(tsns.skipTo(kFirst - 9));
  EXPECT_TRUE(tsns.skipTo(kFirst + 100'000));
  EXPECT_EQ(tsns.cumulative(), kFirst + 100'000);
  EXPECT_FALSE(tsns.hasGaps());
  EXPECT_EQ(tsns.add(kFirst + 100'002), Arrival::isNew);
  EXPECT_EQ(blocksOf(tsns), (std::vector<GapBlock>{{2, 2}}));
}

TEST(ReceivedTsns, BlocksAreBounded) {
  ReceivedTsns tsns(kFirst);
  for (std::uint32_t i = 1; i < ReceivedTsns::kWindow; i += 2) tsns.add(kFirst + i);
  const auto blocks = blocksOf(tsns);
  EXPECT_EQ(blocks.size(), ReceivedTsns::kMaxGapBlocks);
  EXPECT_EQ(blocks.back(), (GapBlock{128, 128}));
}

constexpr Duration kPatience = 30ms;
const Time kStart = Time{} + 1h;

struct Sender {
  SentTsns tsns{kFirst, kPatience};
  Sender() { tsns.setWindow(1 << 20); }
  void send(int count, Time now = kStart) {
    for (; count > 0; --count) tsns.take(now);
  }
};

TEST(SentTsns, GapIsGivenUpAfterPatience) {
  Sender sender;
  sender.send(5);
  EXPECT_EQ(sender.tsns.newest(), kFirst + 4);
  EXPECT_EQ(sender.tsns.deadline(), kNever);
  EXPECT_TRUE(sender.tsns.acknowledge(kStart, {kFirst, 1 << 20, kFirst + 2}));
  EXPECT_EQ(sender.tsns.deadline(), kStart + kPatience);
  EXPECT_FALSE(sender.tsns.giveUp(kStart + kPatience - 1us));
  EXPECT_EQ(sender.tsns.giveUp(kStart + kPatience), kFirst + 2);
  EXPECT_EQ(sender.tsns.deadline(), kNever);
}

TEST(SentTsns, LaterGapWaitsForItsTurn) {
  Sender sender;
  sender.send(8);
  EXPECT_TRUE(sender.tsns.acknowledge(kStart, {kFirst, 1 << 20, kFirst + 2}));
  // A second gap, seen 10 ms later, is not part of the first one.
  EXPECT_TRUE(sender.tsns.acknowledge(kStart + 10ms, {kFirst, 1 << 20, kFirst + 4}));
  EXPECT_EQ(sender.tsns.giveUp(kStart + kPatience), kFirst + 2);
  EXPECT_TRUE(sender.tsns.acknowledge(kStart + 40ms, {kFirst + 2, 1 << 20, kFirst + 4}));
  EXPECT_EQ(sender.tsns.deadline(), kStart + 70ms);
  EXPECT_EQ(sender.tsns.giveUp(kStart + 70ms), kFirst + 4);
}

TEST(SentTsns, FilledGapIsNotGivenUp) {
  Sender sender;
  sender.send(5);
  EXPECT_TRUE(sender.tsns.acknowledge(kStart, {kFirst, 1 << 20, kFirst + 2}));
  EXPECT_TRUE(sender.tsns.acknowledge(kStart + 5ms, {kFirst + 2, 1 << 20, kFirst + 2}));
  EXPECT_EQ(sender.tsns.deadline(), kNever);
  EXPECT_FALSE(sender.tsns.giveUp(kStart + 1s));
}

TEST(SentTsns, LostForwardTsnIsRepeated) {
  Sender sender;
  sender.send(5);
  const Sack sack{kFirst, 1 << 20, kFirst + 2};
  EXPECT_TRUE(sender.tsns.acknowledge(kStart, sack));
  EXPECT_TRUE(sender.tsns.giveUp(kStart + 30ms));
  EXPECT_TRUE(sender.tsns.acknowledge(kStart + 50ms, sack));
  EXPECT_EQ(sender.tsns.giveUp(kStart + 80ms), kFirst + 2);
}

TEST(SentTsns, ReliableMessageIsNotGivenUp) {
  Sender sender;
  sender.send(2);
  const Bytes payload(3);
  sender.tsns.keep({.tsn = sender.tsns.take(kStart), .payload = payload});  // kFirst + 2
  sender.send(2);
  EXPECT_TRUE(sender.tsns.acknowledge(kStart, {kFirst, 1 << 20, kFirst + 4}));
  EXPECT_EQ(sender.tsns.giveUp(kStart + 30ms), kFirst + 1);
  EXPECT_TRUE(sender.tsns.acknowledge(kStart + 60ms, {kFirst + 1, 1 << 20, kFirst + 4}));
  EXPECT_FALSE(sender.tsns.giveUp(kStart + 1s));
  ASSERT_EQ(sender.tsns.kept().size(), 1u);
  EXPECT_EQ(sender.tsns.kept()[0].payload, payload);
  EXPECT_TRUE(sender.tsns.acknowledge(kStart + 61ms, {kFirst + 4, 1 << 20, kFirst + 4}));
  EXPECT_TRUE(sender.tsns.kept().empty());
}

TEST(SentTsns, ImpossibleAcknowledgementsAreIgnored) {
  Sender sender;
  sender.send(3);
  EXPECT_FALSE(sender.tsns.acknowledge(kStart, {kFirst + 3, 0, kFirst + 3}));
  EXPECT_FALSE(sender.tsns.acknowledge(kStart, {kFirst, 0, kFirst + 3}));
  EXPECT_FALSE(sender.tsns.acknowledge(kStart, {kBefore - 1, 0, kBefore - 1}));
  EXPECT_FALSE(sender.tsns.acknowledge(kStart, {0, 0, 0x8000'0000}));
  EXPECT_EQ(sender.tsns.deadline(), kNever);
  EXPECT_TRUE(sender.tsns.hasRoom(kStart));
  EXPECT_TRUE(sender.tsns.acknowledge(kStart, {kFirst + 2, 0, kFirst + 2}));
}

TEST(SentTsns, WindowBoundsWhatIsInFlight) {
  Sender sender;
  sender.tsns.setWindow(3 * kMaxPayloadBytes);
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(sender.tsns.hasRoom(kStart));
    sender.send(1);
  }
  EXPECT_FALSE(sender.tsns.hasRoom(kStart));
  // A message before the newest one that has arrived is no longer in flight.
  EXPECT_TRUE(sender.tsns.acknowledge(kStart, {kBefore, 3 * kMaxPayloadBytes, kFirst + 1}));
  EXPECT_TRUE(sender.tsns.hasRoom(kStart));
  sender.send(2);
  EXPECT_FALSE(sender.tsns.hasRoom(kStart));
}

TEST(SentTsns, ClosedWindowAllowsOneMessage) {
  Sender sender;
  sender.tsns.setWindow(0);
  EXPECT_TRUE(sender.tsns.hasRoom(kStart));
  sender.send(1);
  EXPECT_FALSE(sender.tsns.hasRoom(kStart));
  EXPECT_FALSE(sender.tsns.hasRoom(kStart + SentTsns::kSilence - 1us));
  EXPECT_TRUE(sender.tsns.hasRoom(kStart + SentTsns::kSilence));
  sender.send(1, kStart + SentTsns::kSilence);
  EXPECT_FALSE(sender.tsns.hasRoom(kStart + SentTsns::kSilence));
}

}  // namespace
}  // namespace clothstream::sctp
