// SPDX-License-Identifier: MIT
#include "proto/sctp/data_channel.h"

#include <memory>
#include <string>

#include <gtest/gtest.h>

#include "tests/sctp/bytes.h"
#include "tests/sctp/simulated_link.h"
#include "tests/serving/allocated_bytes.h"

namespace clothstream::sctp {
namespace {

using namespace std::chrono_literals;

// Two channels over a link, of which the first one opens.
struct Channels {
  explicit Channels(const SimulatedLink::Faults& faults = {}, const char* label = "frames",
                    std::uint32_t seed = 1)
      : link(faults, seed),
        first({.label = label, .association = {.tag = 1, .firstTsn = 10}}, to(0), from(0)) {
    link.attach(endOf(first), endOf(second));
  }
  DataChannel::Bytes to(std::size_t end) {
    return [this, end](std::span<const std::byte> packet) { link.send(end, packet); };
  }
  DataChannel::Bytes from(std::size_t end) {
    return [this, end](std::span<const std::byte> bytes) {
      delivered[end].emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    };
  }
  void open() {
    first.connect(link.now());
    link.run(3s);
  }

  SimulatedLink link;
  std::array<std::vector<std::string>, 2> delivered;
  DataChannel first;
  DataChannel second{{.label = "frames", .association = {.tag = 2, .firstTsn = 20}}, to(1), from(1)};
};

TEST(DataChannel, OpensAndMovesMessages) {
  Channels channels;
  EXPECT_EQ(channels.first.send(channels.link.now(), bytesOf("early"), false), SendResult::notConnected);
  channels.open();
  EXPECT_TRUE(channels.first.isOpen() && channels.second.isOpen());
  EXPECT_EQ(channels.link.sent(0), 3u + 1);  // INIT, COOKIE ECHO, OPEN, and an acknowledgement of the ACK
  EXPECT_EQ(channels.first.send(channels.link.now(), bytesOf("up"), false), SendResult::sent);
  EXPECT_EQ(channels.second.send(channels.link.now(), bytesOf("down"), true), SendResult::sent);
  channels.link.run(100ms);
  EXPECT_EQ(channels.delivered[0], std::vector<std::string>{"down"});
  EXPECT_EQ(channels.delivered[1], std::vector<std::string>{"up"});
  EXPECT_TRUE(channels.first.closeReason().empty());
}

TEST(DataChannel, OpensOnVeryBadLink) {
  for (std::uint32_t seed = 0; seed < 20; ++seed) {
    Channels channels({.loss = 0.2, .duplication = 0.1, .jitter = 30ms}, "frames", seed);
    channels.open();
    channels.link.run(5s);
    EXPECT_TRUE(channels.first.isOpen() && channels.second.isOpen());
  }
}

TEST(DataChannel, OtherLabelIsRefused) {
  Channels channels({}, "other");
  channels.open();
  EXPECT_TRUE(channels.first.isClosed());
  EXPECT_EQ(channels.first.closeReason(), "the peer closed the channel");
  EXPECT_FALSE(channels.second.isOpen() || channels.second.isClosed());
}

TEST(DataChannel, CloseEndsBothEnds) {
  Channels channels;
  channels.open();
  channels.second.close("scene ends");
  channels.link.run(100ms);
  EXPECT_TRUE(channels.first.isClosed() && channels.second.isClosed());
  EXPECT_EQ(channels.first.closeReason(), "the peer aborted the association");
  EXPECT_EQ(channels.second.closeReason(), "scene ends");
  EXPECT_EQ(channels.first.deadline(), kNever);
  EXPECT_EQ(channels.first.send(channels.link.now(), bytesOf("late"), false), SendResult::notConnected);
}

TEST(DataChannel, OpenOneNeedsFewBytes) {
  constexpr std::size_t kChannels = 200;
  std::vector<std::unique_ptr<Channels>> all;
  all.reserve(kChannels);
  const auto add = [&] {
    all.push_back(std::make_unique<Channels>());
    all.back()->open();
    EXPECT_TRUE(all.back()->second.isOpen());
  };
  add();
  const double before = tests::allocatedBytes();
  while (all.size() < kChannels) add();
  // Two channels and their link. One channel may take 8 KiB.
  EXPECT_LT((tests::allocatedBytes() - before) / (kChannels - 1), 2.0 * 4096 + sizeof(SimulatedLink));
}

// A channel whose peer is an association, which may send any message.
struct RawPeer {
  RawPeer() {
    link.attach(endOf(peer), endOf(channel));
    peer.connect(link.now());
    link.run(1s);
  }
  // Sends a message, reliable and ordered as DCEP demands, and returns the answers.
  std::vector<std::string> answers(std::uint16_t stream, std::uint32_t protocol, const Bytes& bytes) {
    received.clear();
    EXPECT_EQ(peer.sendReliable(link.now(), {stream, protocol, bytes}), SendResult::sent);
    link.run(500ms);
    return received;
  }

  static constexpr std::uint32_t kDcep = 50;
  const std::vector<std::string> kAcknowledged{"\2"};
  SimulatedLink link{{}};
  std::vector<std::string> received, delivered;
  std::vector<std::uint16_t> resets;
  Association peer{{.tag = 1, .firstTsn = 10},
                   {.transmit = [this](std::span<const std::byte> packet) { link.send(0, packet); },
                    .deliver =
                        [this](const Message& message) {
                          received.emplace_back(reinterpret_cast<const char*>(message.payload.data()),
                                                message.payload.size());
                        },
                    .reset = [this](std::optional<std::uint16_t> stream) { resets.push_back(*stream); }}};
  DataChannel channel{{.label = "frames", .association = {.tag = 2, .firstTsn = 20}},
                      [this](std::span<const std::byte> packet) { link.send(1, packet); },
                      [this](std::span<const std::byte> bytes) {
                        delivered.emplace_back(reinterpret_cast<const char*>(bytes.data()), bytes.size());
                      }};
};

// OPEN of a channel "frames" with a protocol of three bytes. `repeats`: reliability parameter.
Bytes openOf(unsigned type, unsigned repeats = 0) {
  return join({bytesOf({3, type, 1, 0, 0, 0, 0, repeats, 0, 6, 0, 3}),
               bytesOf({'f', 'r', 'a', 'm', 'e', 's', 'c', 's', '1'})});
}

TEST(DataChannelOpen, UnorderedWithoutRepeatsIsTaken) {
  RawPeer raw;
  EXPECT_EQ(raw.answers(6, RawPeer::kDcep, openOf(0x81)), raw.kAcknowledged);
  EXPECT_TRUE(raw.channel.isOpen());
  EXPECT_TRUE(raw.answers(6, RawPeer::kDcep, openOf(0x81)).empty());  // again
  EXPECT_TRUE(raw.channel.isOpen());
  EXPECT_TRUE(raw.resets.empty());
}

TEST(DataChannelOpen, OtherTypesAreRefused) {
  RawPeer raw;
  std::uint16_t stream = 0;
  for (const Bytes& open : {openOf(0), openOf(1), openOf(2), openOf(0x80), openOf(0x82), openOf(0x81, 1)}) {
    EXPECT_TRUE(raw.answers(stream, RawPeer::kDcep, open).empty());
    EXPECT_EQ(raw.resets.size(), ++stream);
  }
  EXPECT_FALSE(raw.channel.isOpen());
  EXPECT_EQ(raw.answers(9, RawPeer::kDcep, openOf(0x81)), raw.kAcknowledged);
}

TEST(DataChannelOpen, DamagedOnesAreRefused) {
  RawPeer raw;
  Bytes longer = openOf(0x81);
  longer.push_back({});
  Bytes shorter = openOf(0x81);
  shorter.pop_back();
  Bytes label = openOf(0x81);
  label[8] = std::byte{0xff};
  std::uint16_t stream = 0;
  for (const Bytes& open :
       {longer, shorter, label, bytesOf({3}), bytesOf({3, 0x81, 0, 0, 0, 0, 0, 0, 0, 0, 0})}) {
    EXPECT_TRUE(raw.answers(stream, RawPeer::kDcep, open).empty());
    EXPECT_EQ(raw.resets.size(), ++stream);
  }
  EXPECT_TRUE(raw.answers(stream, RawPeer::kDcep, bytesOf({2})).empty());  // an ACK
  EXPECT_TRUE(raw.answers(stream, RawPeer::kDcep, bytesOf({77})).empty());
  EXPECT_EQ(raw.resets.size(), stream);
  EXPECT_FALSE(raw.channel.isOpen());
}

TEST(DataChannelOpen, SecondChannelIsRefused) {
  RawPeer raw;
  raw.answers(0, RawPeer::kDcep, openOf(0x81));
  EXPECT_TRUE(raw.answers(2, RawPeer::kDcep, openOf(0x81)).empty());
  EXPECT_EQ(raw.resets, std::vector<std::uint16_t>{2});
  EXPECT_TRUE(raw.channel.isOpen());
}

TEST(DataChannelOpen, OnlyItsBinaryMessagesAreDelivered) {
  RawPeer raw;
  raw.answers(4, 53, bytesOf({1}));  // before OPEN
  raw.answers(4, RawPeer::kDcep, openOf(0x81));
  for (const std::uint32_t protocol : {51u, 54u, 56u, 57u, 0u}) raw.answers(4, protocol, bytesOf({1}));
  raw.answers(5, 53, bytesOf({1}));
  EXPECT_TRUE(raw.delivered.empty());
  raw.answers(4, 53, bytesOf({'y', 'e', 's'}));
  EXPECT_EQ(raw.delivered, std::vector<std::string>{"yes"});
}

TEST(DataChannelOpen, ClosedChannelStaysClosed) {
  RawPeer raw;
  raw.answers(4, RawPeer::kDcep, openOf(0x81));
  raw.peer.resetStream(raw.link.now(), 4);
  raw.link.run(500ms);
  EXPECT_TRUE(raw.channel.isClosed());
  EXPECT_EQ(raw.resets, std::vector<std::uint16_t>{4});  // both directions
  EXPECT_TRUE(raw.answers(6, RawPeer::kDcep, openOf(0x81)).empty());
  EXPECT_FALSE(raw.channel.isOpen());
  EXPECT_EQ(raw.resets, (std::vector<std::uint16_t>{4, 6}));
}

TEST(DataChannelOpen, OtherStreamsMayBeReset) {
  RawPeer raw;
  raw.answers(4, RawPeer::kDcep, openOf(0x81));
  raw.peer.resetStream(raw.link.now(), 5);
  raw.link.run(500ms);
  EXPECT_TRUE(raw.channel.isOpen());
}

}  // namespace
}  // namespace clothstream::sctp
