// SPDX-License-Identifier: MIT
#include "proto/sctp/stream_resets.h"

#include <gtest/gtest.h>

#include "tests/sctp/bytes.h"

namespace clothstream::sctp {
namespace {

constexpr std::uint32_t kOwn = 0xffffffff, kPeer = 100;
constexpr unsigned kPerformed = 1, kDenied = 2, kBadNumber = 5, kInProgress = 6;

Bytes request(unsigned type, unsigned number, const Bytes& rest) {
  const auto length = static_cast<unsigned>(8 + rest.size());
  return join({bytesOf({0, type, 0, length, 0, 0, 0, number}), rest});
}

// Request of the peer to reset its streams.
Bytes outgoing(unsigned number, const Bytes& streams) {
  return request(13, number, join({bytesOf({0, 0, 0, 0, 0, 0, 0, 9}), streams}));
}

Bytes response(unsigned number, unsigned result) {
  return bytesOf({0, 16, 0, 12, 0, 0, 0, number, 0, 0, 0, result});
}

struct StreamResetsTest : ::testing::Test {
  Bytes answer(const Bytes& value) {
    done = resets.receive(value, responses,
                          [this](std::optional<std::uint16_t> stream) { streams.push_back(stream); });
    return responses;
  }

  StreamResets resets{kOwn, kPeer};
  Bytes responses;
  std::vector<std::optional<std::uint16_t>> streams;
  bool done = false;
};

TEST_F(StreamResetsTest, PeerResetsStreams) {
  EXPECT_EQ(answer(outgoing(kPeer, bytesOf({0, 3, 1, 0}))), response(kPeer, kPerformed));
  EXPECT_EQ(streams, (std::vector<std::optional<std::uint16_t>>{3, 256}));
}

TEST_F(StreamResetsTest, PeerResetsAllStreams) {
  EXPECT_EQ(answer(outgoing(kPeer, {})), response(kPeer, kPerformed));
  EXPECT_EQ(streams, (std::vector<std::optional<std::uint16_t>>{std::nullopt}));
}

TEST_F(StreamResetsTest, RepeatedRequestActsOnce) {
  answer(outgoing(kPeer, bytesOf({0, 3})));
  EXPECT_EQ(answer(outgoing(kPeer, bytesOf({0, 3}))), response(kPeer, kPerformed));
  EXPECT_EQ(streams.size(), 1u);
  EXPECT_EQ(answer(outgoing(kPeer + 1, bytesOf({0, 4}))), response(kPeer + 1, kPerformed));
  EXPECT_EQ(streams.size(), 2u);
}

TEST_F(StreamResetsTest, WrongNumberIsRefused) {
  EXPECT_EQ(answer(outgoing(kPeer + 1, bytesOf({0, 3}))), response(kPeer + 1, kBadNumber));
  EXPECT_EQ(answer(outgoing(kPeer - 2, bytesOf({0, 3}))), response(kPeer - 2, kBadNumber));
  EXPECT_TRUE(streams.empty());
}

TEST_F(StreamResetsTest, OtherRequestsAreDenied) {
  unsigned number = kPeer;
  for (const unsigned type : {14u, 15u, 17u, 18u}) {
    EXPECT_EQ(answer(request(type, number, bytesOf({0, 1, 0, 0}))), response(number, kDenied));
    EXPECT_EQ(answer(request(type, number, bytesOf({0, 1, 0, 0}))), response(number, kDenied));
    ++number;
  }
  EXPECT_EQ(answer(request(13, number, bytesOf({0, 0, 0, 0}))), response(number, kDenied));  // too short
  EXPECT_TRUE(streams.empty());
}

TEST_F(StreamResetsTest, TwoParametersAreRead) {
  const Bytes two = join({outgoing(kPeer, bytesOf({0, 3, 0, 4})), outgoing(kPeer + 1, {})});
  EXPECT_EQ(answer(join({two, outgoing(kPeer + 2, {})})),
            join({response(kPeer, kPerformed), response(kPeer + 1, kPerformed)}));
}

TEST_F(StreamResetsTest, DamagedParametersAreIgnored) {
  EXPECT_TRUE(answer({}).empty());
  EXPECT_TRUE(answer(bytesOf({0, 13, 0, 4})).empty());
  EXPECT_TRUE(answer(bytesOf({0, 13, 0, 200, 0, 0, 0, 100})).empty());
  EXPECT_TRUE(answer(bytesOf({0, 16, 0, 8, 0, 0, 0, 0})).empty());
  EXPECT_TRUE(answer(bytesOf({9, 9, 0, 8, 0, 0, 0, 100})).empty());
}

TEST_F(StreamResetsTest, OwnRequestsFollowEachOther) {
  EXPECT_FALSE(resets.isWaiting());
  EXPECT_TRUE(resets.request(5, 77));
  EXPECT_FALSE(resets.request(5, 78));
  EXPECT_TRUE(resets.request(6, 79));
  Bytes value(StreamResets::kRequestBytes);
  resets.writeRequest(value);
  EXPECT_EQ(value, bytesOf({0, 13, 0, 18, 255, 255, 255, 255, 0, 0, 0, 99, 0, 0, 0, 77, 0, 5}));
  answer(response(7, kPerformed));  // of another request
  EXPECT_FALSE(done);
  Bytes own = response(0, kInProgress);
  std::fill_n(own.begin() + 4, 4, std::byte{255});
  answer(own);
  EXPECT_FALSE(done);
  own.back() = std::byte{kPerformed};
  answer(own);
  EXPECT_TRUE(done);
  resets.writeRequest(value);
  EXPECT_EQ(value, bytesOf({0, 13, 0, 18, 0, 0, 0, 0, 0, 0, 0, 99, 0, 0, 0, 79, 0, 6}));
  answer(response(0, kDenied));
  EXPECT_FALSE(resets.isWaiting());
}

TEST_F(StreamResetsTest, WaitingRequestsAreBounded) {
  for (std::uint16_t stream = 0; stream < StreamResets::kMaxRequests; ++stream)
    EXPECT_TRUE(resets.request(stream, 0));
  EXPECT_FALSE(resets.request(StreamResets::kMaxRequests, 0));
}

}  // namespace
}  // namespace clothstream::sctp
