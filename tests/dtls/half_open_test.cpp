// SPDX-License-Identifier: MIT
// Attacks of a peer before its handshake has proven its identity.
#include <chrono>
#include <cstdint>
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/dtls/limits.h"
#include "proto/dtls/record_guard.h"
#include "tests/dtls/simulated_link.h"
#include "tests/serving/allocated_bytes.h"

namespace clothstream::dtls {
namespace {

using namespace std::chrono_literals;
using State = DtlsChannel::State;

void append(Bytes& bytes, std::uint64_t number, std::size_t size) {
  for (std::size_t i = size; i-- > 0;) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}

// A record with any content.
Bytes record(std::uint8_t type, std::uint16_t epoch, const Bytes& content, std::uint64_t number = 1) {
  Bytes bytes;
  append(bytes, type, 1);
  append(bytes, 0xfefd, 2);
  append(bytes, epoch, 2);
  append(bytes, number, 6);
  append(bytes, content.size(), 2);
  bytes.insert(bytes.end(), content.begin(), content.end());
  return bytes;
}

// A fragment of one byte of a message with this number and size.
Bytes fragment(std::uint8_t type, std::uint16_t number, std::size_t size, std::size_t fragmentSize = 1) {
  Bytes bytes;
  append(bytes, type, 1);
  append(bytes, size, 3);
  append(bytes, number, 2);
  append(bytes, 0, 3);
  append(bytes, fragmentSize, 3);
  append(bytes, 0, 1);
  return bytes;
}

bool admits(const Bytes& datagram) {
  return HandshakeGuard().admits(datagram);
}

TEST(HandshakeGuardTest, AdmitsWhatHandshakesSend) {
  SimulatedLink link;
  link.start();
  link.run(200ms);
  for (const Bytes& datagram : link.sent()) EXPECT_TRUE(admits(datagram));
  EXPECT_TRUE(admits(record(20, 0, Bytes(1)))) << "ChangeCipherSpec alone has 14 bytes";
  EXPECT_TRUE(admits(record(21, 0, Bytes(2))));
}

TEST(HandshakeGuardTest, RefusesWhatCostsMemory) {
  EXPECT_TRUE(admits(record(22, 0, fragment(11, 1, kMaxHandshakeMessage))));
  EXPECT_FALSE(admits(record(22, 0, fragment(11, 1, kMaxHandshakeMessage + 1))));
  EXPECT_TRUE(admits(record(22, 0, fragment(11, 7, 100))));
  EXPECT_FALSE(admits(record(22, 0, fragment(11, 8, 100))));
  EXPECT_FALSE(admits(record(23, 1, Bytes(40)))) << "data before the end of the handshake";
  EXPECT_FALSE(admits(record(22, 1, Bytes(39)))) << "too short for Finished";
  EXPECT_FALSE(admits(record(22, 2, Bytes(40))));
  Bytes second = fragment(1, 0, 1);
  const Bytes large = fragment(11, 1, 1 << 20);
  second.insert(second.end(), large.begin(), large.end());
  EXPECT_FALSE(admits(record(22, 0, second))) << "behind another message";
}

TEST(HandshakeGuardTest, RefusesMalformedRecords) {
  const Bytes whole = record(22, 0, fragment(1, 0, 1));
  for (std::size_t size = 1; size < whole.size(); ++size)
    EXPECT_FALSE(admits(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)))) << size;
  EXPECT_FALSE(admits(record(22, 0, fragment(1, 0, 10, 10)))) << "a fragment beyond the record";
  Bytes version = whole;
  version[1] = std::byte{3};
  EXPECT_FALSE(admits(version));
  EXPECT_FALSE(admits(record(24, 0, Bytes(20))));
}

TEST(HandshakeGuardTest, BoundsEncryptedRecordsAndBytes) {
  HandshakeGuard guard;
  for (int i = 0; i < 2; ++i) EXPECT_TRUE(guard.admits(record(22, 1, Bytes(40))));
  EXPECT_FALSE(guard.admits(record(22, 1, Bytes(40))));
  EXPECT_TRUE(guard.admits(record(20, 0, Bytes(1))));
  for (int i = 0; i < 50; ++i) static_cast<void>(guard.admits(Bytes(1000)));
  EXPECT_TRUE(guard.isExhausted());
  EXPECT_FALSE(guard.admits(record(20, 0, Bytes(1))));
}

TEST(RecordGuardTest, RefusesShortEncryptedRecords) {
  Bytes records = record(20, 0, Bytes(1));
  const Bytes encrypted = record(23, 1, Bytes(24));
  records.insert(records.end(), encrypted.begin(), encrypted.end());
  EXPECT_TRUE(hasWholeRecords(records, 24));
  EXPECT_FALSE(hasWholeRecords(records, 25));
  records.pop_back();
  EXPECT_FALSE(hasWholeRecords(records, 0));
}

// Server's ends of associations, whose peers never end the handshake.
class HalfOpenTest : public ::testing::Test {
 protected:
  static constexpr int kPeers = 1000;

  void addPeer() {
    channels_.push_back(std::make_unique<DtlsChannel>(
        SimulatedLink::serverContext(), Role::server, SimulatedLink::clientCertificate().fingerprint(),
        DtlsChannel::Callbacks{.send = [this](std::span<const std::byte>) { ++sent_; }, .receive = {}},
        simulatedNow()));
  }
  Bytes clientHello() {
    SimulatedLink link;
    link.start();
    return link.sent().front();
  }
  double bytesOfPeer(double before) const { return (tests::allocatedBytes() - before) / kPeers; }

  std::vector<std::unique_ptr<DtlsChannel>> channels_;
  int sent_ = 0;
};

TEST_F(HalfOpenTest, SilentPeersCostLittle) {
  addPeer();
  const double before = tests::allocatedBytes();
  for (int i = 0; i < kPeers; ++i) addPeer();
  RecordProperty("bytes", std::to_string(bytesOfPeer(before)));
  EXPECT_LT(bytesOfPeer(before), 16e3);
  simulatedNow() += 8s;
  for (const auto& channel : channels_) {
    channel->advance(simulatedNow());
    ASSERT_EQ(channel->state(), State::failed);
  }
  EXPECT_EQ(sent_, 0);
}

TEST_F(HalfOpenTest, HostilePeersCostBoundedMemory) {
  addPeer();
  const Bytes hello = clientHello();
  const double before = tests::allocatedBytes();
  for (int i = 0; i < kPeers; ++i) {
    addPeer();
    DtlsChannel& channel = *channels_.back();
    channel.handle(hello, simulatedNow());
    for (std::uint16_t number = 1; number < 12; ++number)
      for (const std::size_t size : {kMaxHandshakeMessage, std::size_t{16'384}, std::size_t{0xffffff}})
        channel.handle(record(22, 0, fragment(11, number, size), number), simulatedNow());
    for (std::uint64_t number = 0; number < 10; ++number)
      channel.handle(record(22, 1, Bytes(40), number), simulatedNow());
    ASSERT_EQ(channel.state(), State::handshake) << channel.error();
  }
  RecordProperty("bytes", std::to_string(bytesOfPeer(before)));
  EXPECT_LT(bytesOfPeer(before), 144e3);
  channels_.clear();
  EXPECT_LT(bytesOfPeer(before), 1e3);
}

TEST_F(HalfOpenTest, FloodEndsTheHandshake) {
  addPeer();
  const Bytes hello = clientHello();
  for (int i = 0; i < 400 && channels_[0]->state() == State::handshake; ++i)
    channels_[0]->handle(hello, simulatedNow());
  EXPECT_EQ(channels_[0]->state(), State::failed);
  EXPECT_THAT(channels_[0]->error(), testing::HasSubstr("more than a DTLS handshake needs"));
  EXPECT_LE(sent_, 4) << "repeated messages are not answered";
}

}  // namespace
}  // namespace clothstream::dtls
