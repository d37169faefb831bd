// SPDX-License-Identifier: MIT
// Messages arrive once and in order, whatever is lost, repeated or late on the way.
#include "server/fleet/channel.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;
using Clock = Channel::Clock;

delivery::SharedBytes bytesOf(const std::string& text) {
  const auto* const first = reinterpret_cast<const std::byte*>(text.data());
  return std::make_shared<std::vector<std::byte>>(first, first + text.size());
}

std::string textOf(const delivery::SharedBytes& bytes) {
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

// Two ends, and a way between them that loses segments.
class ChannelTest : public ::testing::Test {
 protected:
  struct End {
    Channel channel;
    std::deque<v1::Segment> arriving = {};
    std::vector<std::string> messages = {};
    bool uses = true;
    bool ended = false;
  };

  void carry(End& from, End& to) {
    from.channel.poll(now_, [&](const v1::Segment& segment) {
      bytes_ += segment.data().size();
      if (std::uniform_real_distribution<>()(random_) >= loss_) to.arriving.push_back(segment);
    });
  }
  static void deliver(End& end, Clock::time_point now) {
    for (const v1::Segment& segment : std::exchange(end.arriving, {}))
      for (const Channel::Received& received : end.channel.receive(segment, now)) {
        if (received.message)
          end.messages.push_back(textOf(received.message));
        else
          end.ended = true;
        if (end.uses) end.channel.use(received.sequence);
      }
  }
  void step(std::chrono::milliseconds time = 20ms) {
    carry(one_, other_);
    carry(other_, one_);
    deliver(one_, now_);
    deliver(other_, now_);
    now_ += time;
  }
  // Steps until everything has arrived. Returns the number of steps.
  int settle() {
    int steps = 0;
    while (!(one_.channel.delivered() && other_.channel.delivered()) && steps < 100'000) step(), ++steps;
    return steps;
  }

  End one_, other_;
  double loss_ = 0;
  std::size_t bytes_ = 0;
  std::mt19937 random_{1};
  Clock::time_point now_{1h};
};

TEST_F(ChannelTest, CarriesMessagesBothWaysAtOnce) {
  one_.channel.push(bytesOf("to the other"), now_);
  other_.channel.push(bytesOf("to the one"), now_);
  step();
  EXPECT_EQ(other_.messages, std::vector<std::string>{"to the other"});
  EXPECT_EQ(one_.messages, std::vector<std::string>{"to the one"});
}

TEST_F(ChannelTest, EmptyAndLongMessagesArriveWhole) {
  const std::string large(3 * Channel::kWindow + 7, 'x');
  std::vector<std::string> sent{"",
                                "a",
                                std::string(Channel::kMaxSegmentBytes, 'b'),
                                std::string(Channel::kMaxSegmentBytes + 1, 'c'),
                                large,
                                "",
                                "end"};
  for (const std::string& text : sent) one_.channel.push(bytesOf(text), now_);
  settle();
  EXPECT_EQ(other_.messages, sent);
}

TEST_F(ChannelTest, NothingIsLostRepeatedOrOutOfOrderOverABadWay) {
  loss_ = 0.4;
  std::vector<std::string> sent;
  for (int i = 0; i < 300; ++i) {
    sent.push_back(std::to_string(i) + std::string(static_cast<std::size_t>(i % 7) * 30'000, '.'));
    one_.channel.push(bytesOf(sent.back()), now_);
    other_.channel.push(bytesOf(sent.back()), now_);
    if (i % 3 == 0) step();
  }
  settle();
  EXPECT_EQ(other_.messages, sent);
  EXPECT_EQ(one_.messages, sent);
}

TEST_F(ChannelTest, WithoutLossNothingIsSentTwice) {
  std::size_t sent = 0;
  for (int i = 0; i < 200; ++i) {
    one_.channel.push(bytesOf(std::string(10'000, 'x')), now_);
    sent += 10'000;
    step();
  }
  settle();
  EXPECT_EQ(bytes_, sent);
}

TEST_F(ChannelTest, AReaderThatDoesNotReadStopsTheSender) {
  other_.uses = false;
  std::size_t pushed = 0;
  for (; one_.channel.hasRoom() && pushed < 100; ++pushed) {
    one_.channel.push(bytesOf(std::string(10'000, 'x')), now_);
    step();
  }
  EXPECT_EQ(pushed, Channel::kWindow / 10'000 + 1);
  for (int i = 0; i < 20; ++i) step();
  EXPECT_FALSE(one_.channel.hasRoom());
  other_.channel.use(other_.messages.size());
  for (int i = 0; i < 5; ++i) step();
  EXPECT_TRUE(one_.channel.hasRoom());
}

TEST_F(ChannelTest, TheEndComesAfterAllMessages) {
  loss_ = 0.3;
  one_.channel.push(bytesOf("last"), now_);
  one_.channel.pushEnd(v1::TUNNEL_END_LEFT);
  settle();
  EXPECT_EQ(other_.messages, std::vector<std::string>{"last"});
  EXPECT_TRUE(other_.ended);
}

// When a scene moves, the new server continues after the messages that the former one has used.
TEST_F(ChannelTest, ReplacedPeerContinuesTheSequence) {
  std::vector<std::string> sent;
  for (int i = 0; i < 40; ++i) {
    sent.push_back(std::to_string(i) + std::string(20'000, '.'));
    one_.channel.push(bytesOf(sent.back()), now_);
  }
  loss_ = 0.3;
  for (int i = 0; i < 30; ++i) step();
  std::vector<std::string> got = other_.messages;
  ASSERT_GT(got.size(), 0u);
  ASSERT_LT(got.size(), sent.size());

  other_ = {.channel = Channel(other_.channel.received())};
  one_.channel.restart();
  one_.arriving.clear();
  other_.channel.push(bytesOf("from the new one"), now_);
  settle();
  got.insert(got.end(), other_.messages.begin(), other_.messages.end());
  EXPECT_EQ(got, sent);
  EXPECT_EQ(one_.messages, std::vector<std::string>{"from the new one"});
}

}  // namespace
}  // namespace clothstream::fleet
