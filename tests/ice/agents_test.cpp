// SPDX-License-Identifier: MIT
// The agents of server and client, also against each other.
#include <algorithm>
#include <chrono>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "proto/ice/checking_agent.h"
#include "proto/ice/lite_agent.h"
#include "tests/ice/sealed_message.h"

namespace clothstream::ice {
namespace {

using namespace std::chrono_literals;

const Address kServerAddress = Address::ofIpv4({192, 0, 2, 1}, 47300);
const Address kHome = Address::ofIpv4({198, 51, 100, 7}, 50000);
const Address kMobile = Address::ofIpv4({203, 0, 113, 9}, 50001);
const Address kIpv6{.bytes = {0x20, 0x01, 0x0d, 0xb8, 1}, .port = 50002};
constexpr Time kStart{1000s};

// The server's agent with a peer whose messages the test writes.
class LiteAgentTest : public ::testing::Test {
 protected:
  std::vector<Datagram> check(const Address& from, Time now, bool nominate = false) {
    return server_.handle(from, peer_.check(newTransaction(), nominate), now);
  }
  // Lets the peer answer the agent's check.
  std::vector<Datagram> answer(const Datagram& check, Time now) {
    const auto message = readStun(check.bytes);
    if (!message) return {};
    const auto answer = peer_.answer(*message, check.bytes, kServerAddress);
    return answer ? server_.handle(check.to, answer->bytes, now) : std::vector<Datagram>();
  }
  void select(const Address& address, Time now) {
    const auto out = check(address, now, true);
    ASSERT_EQ(out.size(), 2U);
    EXPECT_TRUE(answer(out[1], now).empty());
    ASSERT_EQ(server_.selected(now), address);
  }

  Credentials local_ = randomCredentials(), remote_ = randomCredentials();
  LiteAgent server_{local_, remote_, kStart};
  Pairing peer_{remote_, local_, Role::controlling};
};

std::uint16_t errorOf(const std::vector<Datagram>& out) {
  const auto message = out.empty() ? std::nullopt : readStun(out[0].bytes);
  return message ? message->error : std::uint16_t{0};
}

TEST_F(LiteAgentTest, AnswersCheckWithItsSource) {
  const auto bytes = peer_.check(newTransaction(), false);
  const auto out = server_.handle(kIpv6, bytes, kStart);
  ASSERT_EQ(out.size(), 2U) << "the answer and a check";
  const auto response = readStun(out[0].bytes);
  ASSERT_TRUE(response);
  EXPECT_EQ(out[0].to, kIpv6);
  EXPECT_EQ(response->kind, StunKind::success);
  EXPECT_EQ(response->transaction, readStun(bytes)->transaction);
  EXPECT_EQ(response->mapped, kIpv6);
  EXPECT_TRUE(hasIntegrity(*response, out[0].bytes, local_.password));
}

TEST_F(LiteAgentTest, SelectsFirstAddressThatAnswers) {
  const auto out = check(kHome, kStart);
  EXPECT_EQ(server_.selected(kStart), std::nullopt) << "a source can be forged";
  answer(out[1], kStart + 20ms);
  EXPECT_EQ(server_.selected(kStart + 20ms), kHome);
  EXPECT_EQ(check(kMobile, kStart + 30ms).size(), 1U) << "another one that is not nominated";
  EXPECT_EQ(server_.selected(kStart + 30ms), kHome);
}

TEST_F(LiteAgentTest, MovesToNominatedAddressAfterProof) {
  select(kHome, kStart);
  const auto out = check(kMobile, kStart + 1s, true);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(out[1].to, kMobile);
  EXPECT_EQ(server_.selected(kStart + 1s), kHome);
  answer(out[1], kStart + 1050ms);
  EXPECT_EQ(server_.selected(kStart + 1050ms), kMobile);
}

TEST_F(LiteAgentTest, StaysWithoutProof) {
  select(kHome, kStart);
  const auto out = check(kMobile, kStart + 1s, true);
  ASSERT_EQ(out.size(), 2U);
  const auto request = readStun(out[1].bytes);
  ASSERT_TRUE(request);

  StunMessage forged{
      .kind = StunKind::success, .transaction = request->transaction, .mapped = kServerAddress};
  const auto send = [&](const Address& from, const std::string& password) {
    EXPECT_TRUE(server_.handle(from, writeStun(forged, password), kStart + 1s).empty());
    EXPECT_EQ(server_.selected(kStart + 1s), kHome);
  };
  send(kMobile, local_.password);  // wrong password
  send(kIpv6, remote_.password);   // from elsewhere
  forged.transaction[0] ^= std::byte{1};
  send(kMobile, remote_.password);  // another transaction
  forged.transaction[0] ^= std::byte{1};
  forged.kind = StunKind::error;
  send(kMobile, remote_.password);
  forged.kind = StunKind::success;
  EXPECT_TRUE(server_.handle(kMobile, writeStun(forged, remote_.password), kStart + 1s).empty());
  EXPECT_EQ(server_.selected(kStart + 1s), kMobile) << "the right answer";
}

TEST_F(LiteAgentTest, RepeatsUnansweredCheckOnce) {
  const auto out = check(kHome, kStart);
  EXPECT_EQ(server_.nextTime(), kStart + 100ms);
  EXPECT_TRUE(server_.advance(kStart + 99ms).empty());
  const auto repeated = server_.advance(kStart + 100ms);
  ASSERT_EQ(repeated.size(), 1U);
  EXPECT_EQ(repeated[0].bytes, out[1].bytes);
  EXPECT_EQ(server_.nextTime(), Time::max());
  EXPECT_TRUE(server_.advance(kStart + 10s).empty());
  answer(repeated[0], kStart + 600ms);
  EXPECT_EQ(server_.selected(kStart + 600ms), kHome);
}

TEST_F(LiteAgentTest, UnansweredAddressMakesWay) {
  check(kHome, kStart);
  EXPECT_EQ(check(kMobile, kStart + 400ms).size(), 1U);
  const auto out = check(kMobile, kStart + 500ms);
  ASSERT_EQ(out.size(), 2U);
  EXPECT_EQ(check(kHome, kStart + 600ms, true).size(), 2U) << "nominated";
}

TEST_F(LiteAgentTest, SendsAtMostThreeTimesItsInput) {
  std::size_t in = 0, out = 0;
  for (int i = 0; i < 50; ++i) {
    const Time now = kStart + i * 150ms;
    const auto bytes = peer_.check(newTransaction(), i % 2 == 0);
    in += bytes.size();
    for (const Datagram& sent : server_.handle(kIpv6, bytes, now)) out += sent.bytes.size();
    for (const Datagram& sent : server_.advance(now + 100ms)) out += sent.bytes.size();
    EXPECT_LE(out, 3 * in);
  }
  EXPECT_GT(out, 2 * in);
  EXPECT_EQ(server_.selected(kStart), std::nullopt);
}

TEST_F(LiteAgentTest, IgnoresRequestsWithoutThePassword) {
  Credentials wrong = local_;
  wrong.password[0] ^= 1;
  const Pairing stranger(remote_, wrong, Role::controlling);
  EXPECT_TRUE(server_.handle(kHome, stranger.check(newTransaction(), true), kStart).empty());
  Credentials other = remote_;
  other.ufrag = "other";
  const Pairing neighbour(other, local_, Role::controlling);
  EXPECT_TRUE(server_.handle(kHome, neighbour.check(newTransaction(), true), kStart).empty());
  const auto bytes = peer_.check(newTransaction(), true);
  const auto plain = sealed(StunKind::request, std::span(bytes).subspan(20, bytes.size() - 20 - 32), "");
  ASSERT_TRUE(readStun(plain));
  EXPECT_TRUE(server_.handle(kHome, plain, kStart).empty());
  EXPECT_TRUE(server_.handle(kHome, sealed(StunKind::indication, {}, local_.password), kStart).empty());
}

TEST_F(LiteAgentTest, NamesErrorsOfAuthenticRequests) {
  const auto request = [&](StunMessage message) {
    message.kind = StunKind::request;
    const std::string username = local_.ufrag + ':' + remote_.ufrag;
    message.username = username;
    const auto bytes = writeStun(message, local_.password);
    const auto out = server_.handle(kHome, bytes, kStart);
    EXPECT_EQ(out.size(), 1U) << "no check";
    for (const Datagram& sent : out) EXPECT_LE(sent.bytes.size(), bytes.size());
    return errorOf(out);
  };
  EXPECT_EQ(request({.priority = 1, .role = Role::controlled}), kRoleConflict);
  EXPECT_EQ(request({.role = Role::controlling}), kBadRequest);
  EXPECT_EQ(request({.priority = 1}), kBadRequest);

  std::vector<std::byte> attributes;
  const std::string username = local_.ufrag + ':' + remote_.ufrag;
  appendAttribute(attributes, 0x0006, std::as_bytes(std::span(username)));
  appendAttribute(attributes, 0x0077, {});
  const auto bytes = sealed(StunKind::request, attributes, local_.password);
  const auto out = server_.handle(kHome, bytes, kStart);
  EXPECT_EQ(errorOf(out), kUnknownAttribute);
  ASSERT_EQ(out.size(), 1U);
  EXPECT_LE(out[0].bytes.size(), bytes.size());
}

TEST_F(LiteAgentTest, ConsentEndsAndReturnsWithinHalfMinute) {
  select(kHome, kStart);
  EXPECT_EQ(server_.selected(kStart + 4999ms), kHome);
  EXPECT_EQ(server_.selected(kStart + 5s), std::nullopt);
  check(kHome, kStart + 29s);
  EXPECT_EQ(server_.selected(kStart + 29s), kHome);
  EXPECT_FALSE(server_.isOver(kStart + 58999ms));
  EXPECT_TRUE(server_.isOver(kStart + 59s));
  EXPECT_TRUE(check(kHome, kStart + 59s).empty()) << "ended for good";
  EXPECT_TRUE(server_.isOver(kStart + 60s));
}

TEST_F(LiteAgentTest, ChecksFromElsewhereDoNotProlongConsent) {
  select(kHome, kStart);
  check(kMobile, kStart + 4s, true);
  EXPECT_EQ(server_.selected(kStart + 5s), std::nullopt);
}

TEST_F(LiteAgentTest, EndsWithoutAnyProof) {
  for (int second = 0; second < 30; ++second) check(kHome, kStart + second * 1s);
  EXPECT_TRUE(server_.isOver(kStart + 30s));
}

// Client and server, with a network that the test controls. Every datagram needs 25 ms.
class AgentsTest : public ::testing::Test {
 protected:
  struct Flight {
    Datagram datagram;
    Address from;
    bool toServer;
    Time arrives;
  };

  void start(const std::vector<Address>& candidates) {
    client_.emplace(clientCredentials_, serverCredentials_, candidates, now_);
  }
  void send(std::vector<Datagram> datagrams, bool toServer) {
    for (Datagram& datagram : datagrams) {
      (toServer ? fromClient_ : fromServer_) += 1;
      if (toServer) checked_.push_back(datagram.to);
      if (lost_ > 0 && lost_-- > 0) continue;
      if (toServer && !reachable_.contains(datagram.to)) continue;
      const Address from = toServer ? clientAddress_ : reply_;
      flights_.push_back({std::move(datagram), from, toServer, now_ + 25ms});
    }
  }
  void run(Time until) {
    for (; now_ < until; now_ += 1ms) {
      send(client_->advance(now_), true);
      send(server_.advance(now_), false);
      while (!flights_.empty() && flights_.front().arrives <= now_) {
        const Flight flight = std::move(flights_.front());
        flights_.pop_front();
        if (flight.toServer) {
          reply_ = flight.datagram.to;
          send(server_.handle(flight.from, flight.datagram.bytes, now_), false);
        } else if (flight.datagram.to == clientAddress_) {
          send(client_->handle(flight.from, flight.datagram.bytes, now_), true);
        }
      }
    }
  }

  Credentials serverCredentials_ = randomCredentials(), clientCredentials_ = randomCredentials();
  Time now_ = kStart;
  LiteAgent server_{serverCredentials_, clientCredentials_, kStart};
  std::optional<CheckingAgent> client_;
  std::deque<Flight> flights_;
  std::set<Address> reachable_{kServerAddress};
  std::vector<Address> checked_;  // targets of the client's datagrams
  Address clientAddress_ = kHome, reply_ = kServerAddress;
  int fromClient_ = 0, fromServer_ = 0, lost_ = 0;
};

TEST_F(AgentsTest, SelectEachOtherInOneRoundTrip) {
  start({kServerAddress});
  run(kStart + 51ms);
  EXPECT_EQ(client_->selected(now_), kServerAddress);
  EXPECT_EQ(client_->roundTrip(), 50ms);
  run(kStart + 76ms);
  EXPECT_EQ(server_.selected(now_), kHome);
  EXPECT_LE(fromClient_, 6);
}

TEST_F(AgentsTest, CheckSeldomOnceSelected) {
  start({kServerAddress});
  run(kStart + 1s);
  const int before = fromClient_;
  run(kStart + 61s);
  EXPECT_GE(fromClient_ - before, 20);
  EXPECT_LE(fromClient_ - before, 30);
  EXPECT_TRUE(server_.selected(now_));
  EXPECT_TRUE(client_->selected(now_));
}

TEST_F(AgentsTest, SelectDespiteAnyLostDatagrams) {
  for (int lost = 1; lost < 12; ++lost) {
    lost_ = lost;
    flights_.clear();
    server_.~LiteAgent();
    new (&server_) LiteAgent(serverCredentials_, clientCredentials_, now_);
    start({kServerAddress});
    run(now_ + 1s);
    EXPECT_TRUE(server_.selected(now_)) << lost;
    EXPECT_TRUE(client_->selected(now_)) << lost;
  }
}

TEST_F(AgentsTest, CheckFamiliesAlternatelyAndEachOnce) {
  const Address ipv4 = Address::ofIpv4({10, 0, 0, 1}, 1), ipv6{.bytes = {0xfd}, .port = 1};
  start({ipv4, kServerAddress, kIpv6, ipv4, ipv6});
  reachable_.clear();
  run(kStart + 240ms);
  EXPECT_EQ(checked_, (std::vector{kIpv6, ipv4, ipv6, kServerAddress, kIpv6}));
}

TEST_F(AgentsTest, FirstCandidateThatAnswersWins) {
  start({kIpv6, kServerAddress});
  run(kStart + 200ms);
  EXPECT_EQ(client_->selected(now_), kServerAddress);
  const auto nominated = checked_.size();
  run(kStart + 10s);
  EXPECT_EQ(std::count(checked_.begin() + static_cast<std::ptrdiff_t>(nominated), checked_.end(), kIpv6), 0);
}

TEST_F(AgentsTest, CheckAtMostEightCandidates) {
  std::vector<Address> candidates;
  for (std::uint8_t i = 0; i < 100; ++i) candidates.push_back(Address::ofIpv4({10, 0, 0, i}, 1));
  start(candidates);
  run(kStart + 2s);
  EXPECT_EQ(std::set<Address>(checked_.begin(), checked_.end()).size(), CheckingAgent::kMaxCandidates);
}

TEST_F(AgentsTest, FollowMovedClient) {
  start({kServerAddress});
  run(kStart + 1s);
  ASSERT_EQ(server_.selected(now_), kHome);
  clientAddress_ = kMobile;
  run(kStart + 5s);
  EXPECT_EQ(server_.selected(now_), kMobile);
  EXPECT_EQ(client_->selected(now_), kServerAddress);
}

// The silence of the server, whose datagrams go to the old address, makes the client check at once: 100 ms,
// then the client's check, the server's check, and its answer.
TEST_F(AgentsTest, FollowMovedClientThatWasSent) {
  start({kServerAddress});
  run(kStart + 1s);
  client_->arrived(now_);
  clientAddress_ = kMobile;
  run(now_ + 180ms);
  EXPECT_EQ(server_.selected(now_), kMobile);
  // A server that goes on to be silent is not asked more often than any other.
  const int before = fromClient_;
  run(now_ + 60s);
  EXPECT_LE(fromClient_ - before, 30);
}

// A consent check that is due meanwhile, and goes unanswered, does not delay the checks for the silence.
TEST_F(AgentsTest, CheckAfterSilenceDespiteConsent) {
  start({kServerAddress});
  run(kStart + 1s);
  const Time check = client_->nextTime();
  run(check - 10ms);
  client_->arrived(now_);
  reachable_.clear();
  run(check + 100ms);
  const int before = fromClient_;
  run(check + 500ms);
  EXPECT_GE(fromClient_ - before, 4);
}

TEST_F(AgentsTest, PathIsLostAndFoundAgain) {
  start({kServerAddress});
  run(kStart + 1s);
  reachable_.clear();
  run(kStart + 9s);
  EXPECT_EQ(client_->selected(now_), std::nullopt);
  EXPECT_EQ(server_.selected(now_), std::nullopt);
  reachable_.insert(kServerAddress);
  run(now_ + 200ms);
  EXPECT_EQ(client_->selected(now_), kServerAddress);
  EXPECT_EQ(server_.selected(now_), kHome);
}

TEST_F(AgentsTest, EndWhenNothingAnswers) {
  start({kIpv6});
  run(kStart + 31s);
  EXPECT_TRUE(client_->isOver(now_));
  EXPECT_TRUE(server_.isOver(now_));
  EXPECT_EQ(client_->nextTime(), Time::max());
  EXPECT_EQ(fromClient_, 600);
  start({});
  EXPECT_EQ(client_->nextTime(), Time::max());
}

TEST_F(AgentsTest, ClientIgnoresForgedAnswers) {
  start({kServerAddress});
  const auto out = client_->advance(kStart);
  ASSERT_EQ(out.size(), 1U);
  const auto check = readStun(out[0].bytes);
  StunMessage forged{.kind = StunKind::success, .transaction = check->transaction, .mapped = kHome};
  EXPECT_TRUE(
      client_->handle(kServerAddress, writeStun(forged, clientCredentials_.password), kStart).empty());
  EXPECT_TRUE(client_->handle(kMobile, writeStun(forged, serverCredentials_.password), kStart).empty());
  EXPECT_EQ(client_->selected(kStart), std::nullopt);
  const auto nominating =
      client_->handle(kServerAddress, writeStun(forged, serverCredentials_.password), kStart);
  EXPECT_EQ(client_->selected(kStart), kServerAddress);
  ASSERT_EQ(nominating.size(), 1U);
  EXPECT_TRUE(readStun(nominating[0].bytes)->useCandidate);
}

TEST(CredentialsTest, AcceptsOnlyIceCharacters) {
  EXPECT_TRUE(isValid(randomCredentials()));
  EXPECT_NE(randomCredentials().password, randomCredentials().password);
  const Credentials good{.ufrag = "ab+/", .password = std::string(22, 'x')};
  EXPECT_TRUE(isValid(good));
  EXPECT_FALSE(isValid({.ufrag = "abc", .password = good.password}));
  EXPECT_FALSE(isValid({.ufrag = std::string(65, 'a'), .password = good.password}));
  EXPECT_FALSE(isValid({.ufrag = "ab:c", .password = good.password}));
  EXPECT_FALSE(isValid({.ufrag = good.ufrag, .password = std::string(21, 'x')}));
  EXPECT_FALSE(isValid({.ufrag = good.ufrag, .password = std::string(257, 'x')}));
  EXPECT_FALSE(isValid({.ufrag = good.ufrag, .password = std::string(22, '\0')}));
}

}  // namespace
}  // namespace clothstream::ice
