// SPDX-License-Identifier: MIT
#include "server/delivery/sent_packets.h"

#include <chrono>
#include <cstdint>
#include <optional>

#include <gtest/gtest.h>

namespace clothstream::delivery {
namespace {

using namespace std::chrono_literals;

class SentPacketsTest : public testing::Test {
 protected:
  static constexpr std::uint32_t kFirst = 0xffff'fffe;  // wraps after two packets

  // Packets kFirst + n, sent n ms after the start.
  void send(std::uint32_t count) {
    for (; count > 0; --count, ++sent_) packets_.add(kFirst + sent_, 100, kStart + sent_ * 1ms);
  }
  std::optional<SentPackets::Report> receive(std::uint32_t n, std::uint64_t mask) {
    return packets_.receive(kFirst + n, 0, mask, 3ms);
  }

  const Clock::time_point kStart{1h};
  SentPackets packets_;
  std::uint32_t sent_ = 0;
};

TEST_F(SentPacketsTest, CountsWhatArrived) {
  send(3);
  EXPECT_EQ(packets_.inFlight(), 300u);
  const auto report = receive(2, 0b01);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->bytes, 200u);
  EXPECT_EQ(packets_.inFlight(), 100u) << "the first packet may still come";
  ASSERT_TRUE(report->newest);
  EXPECT_EQ(report->newest->sent, kStart + 2ms);
}

TEST_F(SentPacketsTest, PacketIsLostAfterTheReorderingWindow) {
  send(6);
  EXPECT_EQ(receive(2, 0b01)->lost, 0u);
  const auto report = receive(3, 0b011);
  EXPECT_EQ(report->lost, 1u);
  EXPECT_EQ(report->newestLost, kFirst);
  EXPECT_EQ(receive(5, 0b01111)->lost, 0u);
  EXPECT_NEAR(packets_.loss().share(), 0.2, 0.001) << "the fate of the newest packet is not counted yet";
}

TEST_F(SentPacketsTest, ReorderedPacketIsNotLost) {
  send(4);
  EXPECT_EQ(receive(2, 0b01)->bytes, 200u);
  EXPECT_EQ(receive(3, 0b111)->bytes, 200u);
  EXPECT_EQ(packets_.loss().share(), 0);
  EXPECT_EQ(packets_.inFlight(), 0u);
}

TEST_F(SentPacketsTest, LateReceiptsOnlyAddArrivals) {
  send(5);
  EXPECT_EQ(receive(4, 0)->bytes, 100u);
  const auto late = receive(3, 0);
  ASSERT_TRUE(late);
  EXPECT_FALSE(late->newest);
  EXPECT_EQ(receive(3, 0)->bytes, 0u) << "repeated";
}

TEST_F(SentPacketsTest, RefusesNumbersThatWereNotSent) {
  EXPECT_FALSE(receive(2, 0));
  send(3);
  EXPECT_FALSE(receive(3, 0));
  EXPECT_FALSE(receive(0x7fff'fff0, ~std::uint64_t{0}));
  EXPECT_EQ(packets_.inFlight(), 300u);
}

TEST_F(SentPacketsTest, LostReceiptsLeaveNoPacketBehind) {
  send(200);
  const auto report = receive(199, ~std::uint64_t{0});
  EXPECT_EQ(report->packets, 199u);
  EXPECT_EQ(report->lost, 135u) << "no receipt covered them";
  EXPECT_EQ(packets_.inFlight(), 0u);
}

TEST_F(SentPacketsTest, GivesUpOldPackets) {
  send(3);
  EXPECT_FALSE(packets_.expire(kStart + SentPackets::kLongest));
  EXPECT_TRUE(packets_.expire(kStart + SentPackets::kLongest + 1ms));
  EXPECT_EQ(packets_.inFlight(), 200u);
  EXPECT_EQ(packets_.loss().share(), 0);
}

TEST_F(SentPacketsTest, MemoryIsBounded) {
  send(SentPackets::kMost + 100);
  EXPECT_EQ(packets_.inFlight(), 100u * SentPackets::kMost);
}

TEST(LossMeter, MeasuresShareAndBursts) {
  LossMeter meter;
  EXPECT_EQ(meter.share(), 0);
  EXPECT_EQ(meter.burst(), 1);
  for (int i = 0; i < 10'000; ++i) meter.add(i % 100 < 3 || i % 100 == 50);
  EXPECT_NEAR(meter.share(), 0.04, 0.004);
  EXPECT_NEAR(meter.burst(), 2, 0.1);
}

}  // namespace
}  // namespace clothstream::delivery
