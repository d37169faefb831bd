// SPDX-License-Identifier: MIT
// The data channel with usrsctp, an independent implementation, as its peer.
#include <cstring>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "proto/sctp/chunks.h"
#include "proto/sctp/data_channel.h"
#include "tests/sctp/simulated_link.h"
#include "tests/sctp/usrsctp_peer.h"

namespace clothstream::sctp {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kOurs = 0, kTheirs = 1;
constexpr std::uint32_t kDcep = 50, kBinary = 53;

std::string openMessage(std::uint8_t type, const std::string& label) {
  std::string open(12, '\0');
  open[0] = 3;
  open[1] = static_cast<char>(type);
  open[9] = static_cast<char>(label.size());
  return open + label;
}

// Bytes of message `number`.
std::string messageOf(std::uint32_t number, std::size_t size) {
  std::string text(size, static_cast<char>('a' + number % 26));
  std::memcpy(text.data(), &number, sizeof number);
  return text;
}

struct Pair {
  explicit Pair(const SimulatedLink::Faults& faults, UsrsctpPeer::Role role = UsrsctpPeer::Role::connects)
      : link(faults),
        usrsctp(role, link.now(), [this](std::span<const std::byte> packet) { link.send(kTheirs, packet); }),
        channel(
            {.label = "frames", .association = {.tag = 0x12345678, .firstTsn = 0xfffffff0}},
            [this](std::span<const std::byte> packet) { link.send(kOurs, packet); },
            [this](std::span<const std::byte> bytes) {
              delivered.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
            }) {
    link.attach(endOf(channel), endOf(usrsctp));
    link.watch = [this](std::size_t from, std::span<const std::byte> packet, bool isLost) {
      watch(from, packet, isLost);
    };
  }

  void watch(std::size_t from, std::span<const std::byte> bytes, bool isLost) {
    const auto packet = parsePacket(bytes);
    ASSERT_TRUE(packet);
    std::span<const std::byte> rest = packet->chunks;
    while (const auto chunk = takeChunk(rest)) {
      ++chunks[from][static_cast<std::size_t>(chunk->type)];
      if (isLost && chunk->type == ChunkType::data) ++lostMessages[from];
      if (from == kTheirs && chunk->type == ChunkType::sack) theirSack = *parseSack(*chunk);
      if (from == kOurs && chunk->type == ChunkType::data) newestTsn = parseData(*chunk)->tsn;
    }
  }
  std::size_t count(std::size_t from, ChunkType type) const {
    return chunks[from][static_cast<std::size_t>(type)];
  }
  // Opens the channel as a browser does.
  void open() {
    usrsctp.start();
    for (int i = 0; i < 1000 && !usrsctp.isUp(); ++i) link.run(10ms);
    ASSERT_TRUE(usrsctp.send(0, kDcep, openMessage(0x81, "frames")));
    for (int i = 0; i < 1000 && usrsctp.received.empty(); ++i) link.run(10ms);
    ASSERT_TRUE(channel.isOpen());
    ASSERT_EQ(usrsctp.received.size(), 1u);
    EXPECT_EQ(usrsctp.received[0].payload, std::string(1, '\2'));
    EXPECT_EQ(usrsctp.received[0].protocol, kDcep);
    usrsctp.received.clear();
  }
  SendResult send(const std::string& payload) {
    return channel.send(link.now(), std::as_bytes(std::span(payload)), false);
  }

  SimulatedLink link;
  UsrsctpPeer usrsctp;
  DataChannel channel;
  std::vector<std::string> delivered;
  std::array<std::array<std::size_t, 256>, 2> chunks{};
  std::array<std::size_t, 2> lostMessages{};
  Sack theirSack;               // newest
  std::uint32_t newestTsn = 0;  // of ours
};

class UsrsctpLoss : public ::testing::TestWithParam<double> {};

TEST_P(UsrsctpLoss, GetsEveryMessageThatArrives) {
  constexpr std::uint32_t kMessages = 10'000;
  constexpr std::size_t kBytes = 1000, kTheirBytes = 100;
  Pair pair({.loss = GetParam(), .duplication = 0.01, .delay = 25ms, .jitter = 5ms});
  pair.open();
  if (HasFatalFailure()) return;
  pair.lostMessages = {};
  std::uint32_t accepted = 0;
  for (std::uint32_t i = 0; i < kMessages; ++i) {
    ASSERT_EQ(pair.send(messageOf(i, kBytes)), SendResult::sent);
    accepted += pair.usrsctp.send(0, kBinary, messageOf(accepted, kTheirBytes));
    pair.link.run(2ms);
  }
  pair.link.run(5s);
  // Each of our messages was sent once, and arrived if its packet did.
  EXPECT_EQ(pair.usrsctp.received.size(), kMessages - pair.lostMessages[kOurs]);
  std::set<std::string> all;
  for (const UsrsctpPeer::Received& message : pair.usrsctp.received) {
    std::uint32_t number = 0;
    std::memcpy(&number, message.payload.data(), sizeof number);
    EXPECT_EQ(message.payload, messageOf(number, kBytes));
    EXPECT_EQ(message.protocol, kBinary);
    EXPECT_TRUE(all.insert(message.payload).second);
  }
  all.clear();
  for (const std::string& message : pair.delivered) {
    std::uint32_t number = 0;
    std::memcpy(&number, message.data(), sizeof number);
    EXPECT_EQ(message, messageOf(number, kTheirBytes));
    EXPECT_TRUE(all.insert(message).second);
  }
  // Lost numbers are given up: the peer waits for none of them.
  EXPECT_EQ(pair.theirSack.cumulative, pair.newestTsn);
  EXPECT_EQ(pair.count(kOurs, ChunkType::forwardTsn) > 0, GetParam() > 0);
  EXPECT_GE(pair.delivered.size(), accepted - pair.lostMessages[kTheirs]);
  EXPECT_TRUE(pair.channel.isOpen());
  EXPECT_FALSE(pair.usrsctp.hasEnded());
  EXPECT_EQ(pair.usrsctp.reportedErrors, 0u);
  for (const ChunkType type : {ChunkType::abort, ChunkType::error}) {
    EXPECT_EQ(pair.count(kOurs, type), 0u);
    EXPECT_EQ(pair.count(kTheirs, type), 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Percent, UsrsctpLoss, ::testing::Values(0, 0.02, 0.1),
                         [](const auto& loss) { return std::to_string(static_cast<int>(100 * loss.param)); });

TEST(Usrsctp, HandshakeSurvivesEveryLoss) {
  for (std::size_t end = 0; end < 2; ++end) {
    for (std::size_t lost = 0; lost < 5; ++lost) {
      Pair pair({});
      pair.link.losesToo = [&](std::size_t from, std::size_t number) {
        return from == end && number == lost;
      };
      pair.open();
      EXPECT_TRUE(pair.channel.isOpen()) << "packet " << lost << " of end " << end << " is lost";
    }
  }
}

TEST(Usrsctp, BothMayConnect) {
  for (const auto role : {UsrsctpPeer::Role::connects, UsrsctpPeer::Role::listens}) {
    Pair pair({}, role);
    pair.channel.connect(pair.link.now());
    pair.usrsctp.start();
    pair.link.run(5s);
    ASSERT_TRUE(pair.usrsctp.isUp());
    ASSERT_EQ(pair.usrsctp.received.size(), 1u);  // our OPEN
    EXPECT_EQ(pair.usrsctp.received[0].payload, openMessage(0x81, "frames"));
    EXPECT_TRUE(pair.usrsctp.send(0, kDcep, "\2"));
    pair.link.run(100ms);
    EXPECT_TRUE(pair.channel.isOpen());
    EXPECT_EQ(pair.send("hello"), SendResult::sent);
    pair.link.run(100ms);
    EXPECT_EQ(pair.usrsctp.received.back().payload, "hello");
  }
}

TEST(Usrsctp, RefusedChannelIsClosedThere) {
  Pair pair({});
  pair.open();
  ASSERT_TRUE(pair.usrsctp.send(2, kDcep, openMessage(0x81, "more")));
  ASSERT_TRUE(pair.usrsctp.send(4, kDcep, openMessage(0x00, "frames")));
  pair.link.run(1s);
  EXPECT_EQ(pair.usrsctp.resetStreams, (std::vector<std::uint16_t>{2, 4}));
  EXPECT_TRUE(pair.channel.isOpen());
}

TEST(Usrsctp, ClosingClosesBothDirections) {
  Pair pair({});
  pair.open();
  EXPECT_EQ(pair.send("hello"), SendResult::sent);
  ASSERT_TRUE(pair.usrsctp.resetStream(0));
  pair.link.run(1s);
  EXPECT_TRUE(pair.channel.isClosed());
  EXPECT_EQ(pair.usrsctp.resetStreams, std::vector<std::uint16_t>{0});
}

TEST(Usrsctp, LongMessagesAreDropped) {
  Pair pair({});
  pair.open();
  EXPECT_TRUE(pair.usrsctp.send(0, kBinary, std::string(5000, 'x')));
  EXPECT_TRUE(pair.usrsctp.send(0, kBinary, "short"));
  pair.link.run(1s);
  EXPECT_EQ(pair.delivered, std::vector<std::string>{"short"});
}

TEST(Usrsctp, IdleConnectionStays) {
  Pair pair({});
  pair.open();
  pair.link.run(10min);
  EXPECT_GT(pair.count(kTheirs, ChunkType::heartbeat), 10u);
  EXPECT_EQ(pair.count(kTheirs, ChunkType::heartbeat), pair.count(kOurs, ChunkType::heartbeatAck));
  EXPECT_EQ(pair.send("hello"), SendResult::sent);
  pair.link.run(1s);
  EXPECT_EQ(pair.usrsctp.received.size(), 1u);
}

TEST(Usrsctp, ShutdownEndsBothEnds) {
  Pair pair({});
  pair.open();
  pair.usrsctp.shutdown();
  pair.link.run(1s);
  EXPECT_TRUE(pair.usrsctp.hasEnded());
  EXPECT_EQ(pair.channel.closeReason(), "the peer shut the association down");
  EXPECT_EQ(pair.count(kTheirs, ChunkType::shutdownComplete), 1u);
}

TEST(Usrsctp, AbortEndsBothEnds) {
  Pair pair({});
  pair.open();
  pair.channel.close("scene ends");
  pair.link.run(1s);
  EXPECT_TRUE(pair.usrsctp.hasEnded());
}

}  // namespace
}  // namespace clothstream::sctp
