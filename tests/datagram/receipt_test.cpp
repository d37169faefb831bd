// SPDX-License-Identifier: MIT
// Receipts: bytes, mask, and when they are due.
#include "proto/datagram/receipt.h"

#include <array>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "tests/datagram/frames.h"

namespace clothstream::datagram {
namespace {

TEST(Receipt, ReadsWhatItWrites) {
  std::array<std::byte, kMaxDatagramBytes> out;
  const std::size_t bytes =
      writeReceipt({.newest = 7, .arrivalUs = 0xfffffff0, .before = 0x8000000000000001}, out);
  ASSERT_EQ(bytes, 17u);
  const auto receipt = parseReceipt(std::span(out).first(bytes));
  ASSERT_TRUE(receipt);
  EXPECT_EQ(receipt->newest, 7u);
  EXPECT_EQ(receipt->arrivalUs, 0xfffffff0);
  EXPECT_EQ(receipt->before, 0x8000000000000001);
  EXPECT_FALSE(parseReceipt(std::span(out).first(16)));
  EXPECT_FALSE(parseReceipt(std::span(out).first(18)));
  out[0] = std::byte{1};
  EXPECT_FALSE(parseReceipt(std::span(out).first(17)));
}

TEST(Receipt, ShowsWhatArrived) {
  // Shuffled within windows, with losses, and across the wrap of the numbers.
  std::mt19937 random(3);
  ReceivedPackets packets;
  std::set<std::uint32_t> arrived;
  std::uint32_t newest = 0xffffff00;
  for (std::uint32_t step = 0; step < 400; ++step) {
    const std::uint32_t packet = 0xffffff00 + step + static_cast<std::uint32_t>(random() % 12);
    if (random() % 10 == 0) continue;
    packets.add(packet, step);
    arrived.insert(packet);
    if (steps(newest, packet) > 0) newest = packet;
    const auto receipt = packets.take();
    if (!receipt) continue;
    EXPECT_EQ(receipt->newest, newest);
    EXPECT_TRUE(receipt->shows(newest));
    for (std::uint32_t age = 1; age <= 64; ++age)
      EXPECT_EQ(receipt->shows(newest - age), arrived.contains(newest - age)) << step << ", age " << age;
    EXPECT_FALSE(receipt->shows(newest - 65));
    EXPECT_FALSE(receipt->shows(newest + 1));
  }
}

TEST(Receipt, JumpsForgetWhatWasBefore) {
  for (const std::uint32_t jump : {63u, 64u, 65u, 1000u, 0x7fffffffu}) {
    ReceivedPackets packets;
    packets.add(5, 0);
    packets.add(5 + jump, 0);
    EXPECT_EQ(packets.take()->before, jump <= 64 ? std::uint64_t{1} << (jump - 1) : 0) << jump;
  }
}

TEST(Receipt, HasTheArrivalOfTheNewest) {
  ReceivedPackets packets;
  packets.add(2, 100);
  packets.add(1, 200);
  EXPECT_EQ(packets.take()->arrivalUs, 100u);
}

TEST(Receipt, IsDueAfterTwentyMilliseconds) {
  ReceivedPackets packets;
  EXPECT_FALSE(packets.dueUs());
  EXPECT_FALSE(packets.take());
  packets.add(0, 1'000);
  packets.add(1, 2'000);
  EXPECT_EQ(packets.dueUs(), 21'000u);
  EXPECT_TRUE(packets.take());
  EXPECT_FALSE(packets.dueUs());
  packets.add(1, 3'000);
  EXPECT_FALSE(packets.dueUs()) << "a duplicate says nothing new";
  for (std::uint32_t i = 2; i < 2 + ReceivedPackets::kMaxUnreported; ++i) packets.add(i, 4'000);
  EXPECT_EQ(packets.dueUs(), 4'000u) << "the mask would lose packets";
}

}  // namespace
}  // namespace clothstream::datagram
