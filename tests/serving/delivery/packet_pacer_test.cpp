// SPDX-License-Identifier: MIT
#include "server/delivery/packet_pacer.h"

#include <chrono>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::delivery {
namespace {

using namespace std::chrono_literals;

constexpr double kPaceRate = 1e6;  // bytes/s: 1 ms for 1000 bytes
constexpr auto kQuantum = 4ms;

class PacketPacerTest : public testing::Test {
 protected:
  void add(int packet, bool repeated = false) { ASSERT_TRUE(pacer_.add(packet, 1000, repeated, now_)); }
  std::vector<int> takeUntil(Clock::time_point end) {
    std::vector<int> taken;
    while (pacer_.due() && *pacer_.due() <= end) {
      now_ = std::max(now_, *pacer_.due());
      while (const auto packet = pacer_.next(kPaceRate, kQuantum, now_)) taken.push_back(*packet);
    }
    now_ = end;
    return taken;
  }

  Clock::time_point now_{1h};
  PacketPacer<int> pacer_;
};

TEST_F(PacketPacerTest, SpreadsPacketsByRate) {
  for (int i = 0; i < 12; ++i) add(i);
  EXPECT_EQ(takeUntil(now_), (std::vector{0, 1, 2, 3, 4}));
  EXPECT_EQ(pacer_.bytes(), 7000u);
  EXPECT_EQ(takeUntil(now_ + 4999us), std::vector<int>{});
  EXPECT_EQ(takeUntil(now_ + 1us), (std::vector{5, 6, 7, 8, 9}));
  EXPECT_EQ(takeUntil(now_ + 5ms), (std::vector{10, 11}));
  EXPECT_EQ(pacer_.due(), std::nullopt);
  EXPECT_EQ(pacer_.bytes(), 0u);
}

TEST_F(PacketPacerTest, LaterPacketsWaitTheirTurn) {
  add(0);
  takeUntil(now_ + 1us);
  add(1);
  EXPECT_EQ(pacer_.next(kPaceRate, kQuantum, now_), std::nullopt)
      << "the quantum is that of a packet which is due";
  EXPECT_EQ(takeUntil(now_ + 1ms), std::vector{1});
}

TEST_F(PacketPacerTest, RepeatedPacketsLeaveFirst) {
  add(1);
  add(2);
  add(11, true);
  add(12, true);
  EXPECT_EQ(takeUntil(now_ + 10ms), (std::vector{11, 12, 1, 2}));
}

TEST_F(PacketPacerTest, IdleTimeEnlargesNoBurst) {
  add(0);
  takeUntil(now_ + 1s);
  for (int i = 1; i < 10; ++i) add(i);
  EXPECT_EQ(takeUntil(now_), (std::vector{1, 2, 3, 4, 5}));
}

TEST_F(PacketPacerTest, LateTimerDelaysNoLaterPacket) {
  for (int i = 0; i < 20; ++i) add(i);
  takeUntil(now_);
  now_ += 6500us;  // 1.5 ms late
  std::vector<int> taken;
  while (const auto packet = pacer_.next(kPaceRate, kQuantum, now_)) taken.push_back(*packet);
  EXPECT_EQ(taken, (std::vector{5, 6, 7, 8, 9, 10}));
  EXPECT_EQ(*pacer_.due(), Clock::time_point(1h) + 11ms);
}

TEST_F(PacketPacerTest, QueueIsBounded) {
  for (std::size_t i = 0; i < PacketPacer<int>::kMost; ++i) add(0);
  EXPECT_FALSE(pacer_.add(0, 1000, false, now_));
  EXPECT_TRUE(pacer_.add(0, 1000, true, now_)) << "repeated packets have a queue of their own kind";
  pacer_.clear();
  EXPECT_EQ(pacer_.bytes(), 0u);
  EXPECT_EQ(pacer_.due(), std::nullopt);
}

TEST(PacketPacer, MovesPackets) {
  PacketPacer<std::unique_ptr<int>> pacer;
  ASSERT_TRUE(pacer.add(std::make_unique<int>(7), 1, false, Clock::time_point(1h)));
  EXPECT_EQ(**pacer.next(kPaceRate, kQuantum, Clock::time_point(1h)), 7);
}

}  // namespace
}  // namespace clothstream::delivery
