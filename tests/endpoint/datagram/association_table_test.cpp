// SPDX-License-Identifier: MIT
// Datagrams that an association takes, and the cost of others. Time is simulated.
#include "server/endpoint/datagram/association_table.h"

#include <chrono>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "server/delivery/mailbox.h"

namespace clothstream::endpoint {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::byte>;

// One association, whose peer is at kPeer.
class AssociationTableTest : public ::testing::Test {
 protected:
  AssociationTableTest() {
    table.add(
        server,
        {.name = "peer",
         .reached = {},
         .offer = {.ufrag = client.ufrag, .password = client.password, .fingerprint = {}},
         .outlet = std::make_shared<delivery::Mailbox>([] {}),
         .receive = [](auto) {}},
        [] {}, now);
  }

  // Number of datagrams that the server sends when it gets this one.
  std::size_t answersTo(const Address& from, const Bytes& datagram) {
    sent.clear();
    table.handle({.peer = from}, datagram, now);
    return sent.size();
  }
  // The peer sends a check, and answers that of the server.
  void prove(const Address& from) {
    ASSERT_EQ(answersTo(from, check()), 2u);
    const Bytes theirs = sent.back().second;
    const auto message = ice::readStun(theirs);
    ASSERT_TRUE(message);
    const auto answer = peer.answer(*message, theirs, from);
    ASSERT_TRUE(answer);
    answersTo(from, answer->bytes);
  }
  Bytes check() const { return peer.check(ice::newTransaction(), true); }

  const Address kPeer = Address::ofIpv4({192, 0, 2, 1}, 4000), kStranger = Address::ofIpv4({192, 0, 2, 2}, 1);
  Time now{1h};
  const ice::Credentials server = ice::randomCredentials(), client = ice::randomCredentials();
  const ice::Pairing peer{client, server, ice::Role::controlling};
  const dtls::Certificate certificate;
  const dtls::DtlsContext context{certificate};
  SharedPieces pieces;
  telemetry::DatagramMetrics metrics;
  std::vector<std::pair<Address, Bytes>> sent;
  AssociationTable table{{.dtls = context, .pieces = pieces, .metrics = metrics},
                         [this](const Route& route, std::span<const std::byte> datagram) {
                           sent.emplace_back(route.peer, Bytes(datagram.begin(), datagram.end()));
                         }};
};

TEST_F(AssociationTableTest, AnswersChecksOfPeer) {
  prove(kPeer);
  EXPECT_EQ(answersTo(kPeer, check()), 1u);
}

TEST_F(AssociationTableTest, StrangersDoNotStarvePeer) {
  prove(kPeer);
  const ice::Pairing wrong(client, {.ufrag = server.ufrag, .password = client.password},
                           ice::Role::controlling);
  const Bytes forged = wrong.check(ice::newTransaction(), true);
  for (std::uint16_t port = 1; port < 5000; ++port)
    ASSERT_EQ(answersTo({.bytes = kStranger.bytes, .port = port}, forged), 0u);
  EXPECT_EQ(answersTo(kPeer, check()), 1u);
}

TEST_F(AssociationTableTest, DropsTooManyDatagramsOfPeer) {
  prove(kPeer);
  std::size_t answers = 0;
  for (int i = 0; i < 1000; ++i) answers += answersTo(kPeer, check());
  EXPECT_LE(answers, static_cast<std::size_t>(Association::kBurst));
  now += 1s;
  EXPECT_EQ(answersTo(kPeer, check()), 1u);
}

// It says nothing, and proves nothing.
TEST_F(AssociationTableTest, IgnoresRecordsOfStrangers) {
  EXPECT_EQ(answersTo(kStranger, Bytes(1200, std::byte{22})), 0u);
  EXPECT_EQ(answersTo(kStranger, Bytes(100, std::byte{0})), 0u);
  EXPECT_EQ(answersTo(kStranger, {}), 0u);
}

}  // namespace
}  // namespace clothstream::endpoint
