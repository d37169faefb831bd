// SPDX-License-Identifier: MIT
#include "proto/dtls/dtls_channel.h"

#include <chrono>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/dtls/simulated_link.h"

namespace clothstream::dtls {
namespace {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using testing::HasSubstr;
using State = DtlsChannel::State;

Bytes payloadOf(std::string_view text) {
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

// Sends a payload each way, and returns whether both arrive.
bool carriesPayloads(SimulatedLink& link) {
  link.client.received.clear();
  link.server.received.clear();
  if (!link.client.channel->send(payloadOf("up")) || !link.server.channel->send(payloadOf("down")))
    return false;
  link.run(100ms);
  return link.server.received == std::vector<Bytes>{payloadOf("up")} &&
         link.client.received == std::vector<Bytes>{payloadOf("down")};
}

// Number of datagrams of a handshake without losses.
std::size_t datagramsOfHandshake() {
  static const std::size_t count = [] {
    SimulatedLink link;
    link.start();
    link.run(200ms);
    return link.sent().size();
  }();
  return count;
}

TEST(DtlsChannelTest, OpensInTwoRoundTrips) {
  SimulatedLink link;
  link.start();
  link.run(100ms);
  ASSERT_TRUE(link.isOpen()) << link.client.channel->error() << link.server.channel->error();
  EXPECT_EQ(link.client.channel->statistics().handshake, 100ms);
  EXPECT_EQ(link.server.channel->statistics().handshake, 75ms);
  EXPECT_EQ(link.client.channel->nextTime(), Time::max());
  for (const Bytes& datagram : link.sent()) EXPECT_LE(datagram.size(), kHandshakeMtu);
  EXPECT_TRUE(carriesPayloads(link));
}

TEST(DtlsChannelTest, SendsEachPayloadAtOnce) {
  SimulatedLink link;
  link.start();
  link.run(200ms);
  const std::size_t before = link.sent().size();
  for (const std::size_t size : {std::size_t{1}, std::size_t{1150}, kMaxPayloadBytes})
    EXPECT_TRUE(link.client.channel->send(Bytes(size)));
  ASSERT_EQ(link.sent().size(), before + 3);
  EXPECT_EQ(link.sent().back().size(), 1232U);
  EXPECT_FALSE(link.client.channel->send(Bytes(kMaxPayloadBytes + 1)));
  EXPECT_FALSE(link.client.channel->send({}));
  link.run(50ms);
  ASSERT_EQ(link.server.received.size(), 3U);
  EXPECT_EQ(link.server.received.back().size(), kMaxPayloadBytes);
  EXPECT_EQ(link.server.channel->statistics().payloads, 3U);
}

// Every datagram, also of the repetitions, is lost once, and every pair of datagrams.
TEST(DtlsChannelTest, OpensDespiteLossOfAnyDatagrams) {
  const std::size_t count = datagramsOfHandshake() + 4;
  for (std::size_t first = 0; first < count; ++first)
    for (std::size_t second = first; second < count; ++second) {
      bool lossy = true;
      SimulatedLink link([&](std::size_t number) {
        return lossy && (number == first || number == second) ? std::vector<milliseconds>()
                                                              : std::vector{25ms};
      });
      link.start();
      link.run(800ms);
      ASSERT_TRUE(link.isOpen()) << first << ", " << second << link.client.channel->error();
      lossy = false;
      EXPECT_TRUE(carriesPayloads(link)) << first << ", " << second;
    }
}

TEST(DtlsChannelTest, OpensDespiteDoubledDatagrams) {
  SimulatedLink link([](std::size_t) { return std::vector{25ms, 25ms, 40ms}; });
  link.start();
  link.run(300ms);
  ASSERT_TRUE(link.isOpen());
  EXPECT_TRUE(carriesPayloads(link)) << "doubled payloads arrive once";
}

TEST(DtlsChannelTest, OpensDespiteReorderedDatagrams) {
  for (std::size_t late = 0; late < datagramsOfHandshake(); ++late)
    for (const milliseconds delay : {30ms, 90ms, 300ms}) {
      SimulatedLink link([=](std::size_t number) { return std::vector{number == late ? delay : 25ms}; });
      link.start();
      link.run(800ms);
      ASSERT_TRUE(link.isOpen()) << late;
      EXPECT_TRUE(carriesPayloads(link));
    }
}

TEST(DtlsChannelTest, OpensOnBadLink) {
  int opened = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    SimulatedLink link([&](std::size_t) {
      std::vector<milliseconds> arrivals;
      while (random() % 10 >= 3) {  // lost in 3 of 10 cases, sometimes doubled
        arrivals.push_back(milliseconds(20 + random() % 50));
        if (random() % 4 != 0) break;
      }
      return arrivals;
    });
    link.start();
    link.run(8s);
    opened += link.isOpen() ? 1 : 0;
  }
  EXPECT_GE(opened, 19);
}

TEST(DtlsChannelTest, RepeatsFlightsWithGrowingIntervals) {
  SimulatedLink link([](std::size_t) { return std::vector<milliseconds>(); });
  link.start();
  const Time begun = simulatedNow();
  std::vector<Time::duration> times;
  while (link.client.channel->state() == State::handshake && times.size() < 20) {
    const Time next = link.client.channel->nextTime();
    times.push_back(next - begun);
    link.run(std::chrono::duration_cast<milliseconds>(next - simulatedNow()));
  }
  EXPECT_EQ(std::vector(times.begin(), times.begin() + 6),
            (std::vector<Time::duration>{100ms, 300ms, 700ms, 1500ms, 2300ms, 3100ms}));
  EXPECT_EQ(times.back(), 8s);
  EXPECT_EQ(link.client.channel->state(), State::failed);
  EXPECT_THAT(link.client.channel->error(), HasSubstr("longer than 8 s"));
  EXPECT_EQ(link.server.channel->state(), State::failed) << "a server that hears nothing";
  EXPECT_EQ(link.client.channel->nextTime(), Time::max());
  EXPECT_EQ(link.client.channel->statistics().repeatedFlights, 12U);
}

TEST(DtlsChannelTest, RefusesForeignCertificateOfClient) {
  SimulatedLink link;
  link.expectedOfClient = Certificate().fingerprint();
  link.start();
  link.run(1s);
  EXPECT_EQ(link.server.channel->state(), State::failed);
  EXPECT_THAT(link.server.channel->error(), HasSubstr("fingerprint " + link.expectedOfClient));
  EXPECT_EQ(link.client.channel->state(), State::failed);
  EXPECT_THAT(link.client.channel->error(), HasSubstr("alert"));
  EXPECT_FALSE(link.client.channel->send(payloadOf("up")));
  EXPECT_TRUE(link.server.received.empty());
}

TEST(DtlsChannelTest, RefusesForeignCertificateOfServer) {
  SimulatedLink link;
  link.expectedOfServer = Certificate().fingerprint();
  link.start();
  link.run(1s);
  EXPECT_EQ(link.client.channel->state(), State::failed);
  EXPECT_THAT(link.client.channel->error(), HasSubstr("fingerprint " + link.expectedOfServer));
  EXPECT_EQ(link.server.channel->state(), State::failed);
}

TEST(DtlsChannelTest, RefusesClientWithoutCertificate) {
  const std::unique_ptr<SSL_CTX, tls::Freed<SSL_CTX_free>> context(SSL_CTX_new(DTLS_client_method()));
  const std::unique_ptr<SSL, tls::Freed<SSL_free>> client(SSL_new(context.get()));
  BIO *const in = BIO_new(BIO_s_mem()), *const out = BIO_new(BIO_s_mem());
  SSL_set_bio(client.get(), in, out);
  SSL_set_connect_state(client.get());
  const auto toClient = [in](std::span<const std::byte> datagram) {
    BIO_write(in, datagram.data(), static_cast<int>(datagram.size()));
  };
  DtlsChannel server(SimulatedLink::serverContext(), Role::server,
                     SimulatedLink::clientCertificate().fingerprint(),
                     {.send = toClient, .receive = [](auto) { ADD_FAILURE(); }}, simulatedNow());
  for (int i = 0; i < 4; ++i) {
    SSL_do_handshake(client.get());
    Bytes flight(kMaxDatagramBytes);
    const int size = BIO_read(out, flight.data(), static_cast<int>(flight.size()));
    if (size > 0) server.handle(std::span(flight).first(static_cast<std::size_t>(size)), simulatedNow());
  }
  EXPECT_EQ(server.state(), State::failed);
  EXPECT_THAT(server.error(), HasSubstr("certificate"));
}

TEST(DtlsChannelTest, CloseNotifyEndsBothEnds) {
  SimulatedLink link;
  link.start();
  link.run(200ms);
  link.client.channel->close();
  EXPECT_EQ(link.client.channel->state(), State::closed);
  link.run(25ms);
  EXPECT_EQ(link.server.channel->state(), State::closed);
  EXPECT_EQ(link.server.channel->error(), "");
  EXPECT_FALSE(link.server.channel->send(payloadOf("down")));
  const std::size_t sent = link.sent().size();
  link.client.channel->close();
  link.run(1s);
  EXPECT_EQ(link.sent().size(), sent) << "closed channels are silent";
}

TEST(DtlsChannelTest, IgnoresDamagedAndRepeatedRecords) {
  SimulatedLink link;
  link.start();
  link.run(200ms);
  ASSERT_TRUE(link.client.channel->send(payloadOf("up")));
  const Bytes record = link.sent().back();
  for (std::size_t i = 0; i < record.size(); ++i) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      Bytes damaged = record;
      damaged[i] ^= static_cast<std::byte>(1U << bit);
      link.server.channel->handle(damaged, simulatedNow());
      ASSERT_TRUE(link.isOpen()) << i << ", " << bit << link.server.channel->error();
    }
    link.server.channel->handle(std::span(record).first(i), simulatedNow());
  }
  for (std::size_t size = 0; size < 40; ++size) {
    Bytes forged(record.begin(), record.begin() + 13);
    forged[12] = static_cast<std::byte>(size);
    forged.resize(13 + size);
    link.server.channel->handle(forged, simulatedNow());
    ASSERT_TRUE(link.isOpen()) << size << link.server.channel->error();
  }
  link.server.channel->handle(Bytes(kMaxDatagramBytes + 1), simulatedNow());
  EXPECT_TRUE(link.server.received.empty());
  for (int i = 0; i < 3; ++i) link.server.channel->handle(record, simulatedNow());
  EXPECT_EQ(link.server.received, std::vector<Bytes>{payloadOf("up")});
  link.run(50ms);
  EXPECT_TRUE(link.isOpen());
}

TEST(DtlsChannelTest, ReceiverMayAnswerAndClose) {
  SimulatedLink link;
  link.start();
  link.run(200ms);
  link.server.onPayload = [](DtlsChannel& server) {
    EXPECT_TRUE(server.send(payloadOf("answer")));
    server.close();
  };
  ASSERT_TRUE(link.client.channel->send(payloadOf("a")));
  Bytes both = link.sent().back();
  ASSERT_TRUE(link.client.channel->send(payloadOf("b")));
  both.insert(both.end(), link.sent().back().begin(), link.sent().back().end());
  link.server.channel->handle(both, simulatedNow());
  EXPECT_EQ(link.server.received, std::vector<Bytes>{payloadOf("a")}) << "the second record of the datagram";
  link.run(25ms);
  EXPECT_EQ(link.client.received, std::vector<Bytes>{payloadOf("answer")});
  EXPECT_EQ(link.client.channel->state(), State::closed);
}

TEST(DtlsChannelTest, ReadsAllRecordsOfDatagram) {
  SimulatedLink link;
  link.start();
  link.run(200ms);
  Bytes all;
  for (const char* text : {"a", "b", "c"}) {
    ASSERT_TRUE(link.client.channel->send(payloadOf(text)));
    all.insert(all.end(), link.sent().back().begin(), link.sent().back().end());
  }
  link.server.channel->handle(all, simulatedNow());
  EXPECT_EQ(link.server.received, (std::vector<Bytes>{payloadOf("a"), payloadOf("b"), payloadOf("c")}));
}

// Many channels with one error queue: an error of one is not one of its neighbour.
TEST(DtlsChannelTest, ErrorsStayInTheirChannel) {
  SimulatedLink good, bad;
  bad.expectedOfClient = Certificate().fingerprint();
  good.start();
  bad.start();
  ERR_raise(ERR_LIB_SSL, SSL_R_BAD_LENGTH);
  for (int i = 0; i < 20; ++i) {
    bad.run(10ms);
    simulatedNow() -= 10ms;
    good.run(10ms);
  }
  EXPECT_TRUE(good.isOpen());
  EXPECT_EQ(bad.server.channel->state(), State::failed);
}

}  // namespace
}  // namespace clothstream::dtls
