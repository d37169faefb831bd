// SPDX-License-Identifier: MIT
// Attacks on the UDP port, from strangers and from participants.
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "proto/datagram/piece_request.h"
#include "proto/datagram/receipt.h"
#include "tests/attack/attacks/attacker.h"
#include "tests/attack/attacks/offering_peer.h"

namespace clothstream::attack {
namespace {

using namespace std::chrono_literals;
using Answer = OfferingPeer::Answer;

// Longest time of a handshake of the attacker itself.
constexpr std::chrono::seconds kPatience{5};

std::vector<std::byte> randomBytes(std::mt19937& random, std::size_t size) {
  std::vector<std::byte> bytes(size);
  for (std::byte& byte : bytes) byte = static_cast<std::byte>(random());
  return bytes;
}

// Bytes that an address has got for each byte that came from it, in words.
std::string shareOf(std::uint64_t got, std::uint64_t sent) {
  return fmt::format("{} ({:.2f})", got <= 3 * sent ? "at most three times the bytes" : "too many bytes",
                     static_cast<double>(got) / static_cast<double>(std::max<std::uint64_t>(sent, 1)));
}

// Datagrams of every size, as of every protocol on the port.
std::string floodPort(const Target& target) {
  OfferingPeer peer(target);
  if (peer.offer() != Answer::accepted) return "the server opens no datagrams";
  std::array<std::unique_ptr<UdpSource>, kFlooders> sources;
  for (auto& source : sources) source = std::make_unique<UdpSource>();
  const std::uint64_t sent = flood(target, [&](int i) {
    thread_local std::mt19937 random(static_cast<unsigned>(i));
    std::vector<std::byte> bytes = randomBytes(random, random() % 1500);
    if (!bytes.empty()) bytes[0] = static_cast<std::byte>(random() % 64);  // STUN, DTLS and others (RFC 7983)
    sources[static_cast<std::size_t>(i)]->send(peer.server(), bytes);
  });
  std::uint64_t answers = 0;
  for (const auto& source : sources)
    while (source->receive()) ++answers;
  return fmt::format("{} datagrams sent, {} answers", sent, answers);
}

// Checks without the password, with an unknown user name or that of another peer, from many ports. The other
// peer goes on with its own checks.
std::string floodWrongChecks(const Target& target) {
  constexpr std::size_t kPorts = 32;
  OfferingPeer named(target);
  UdpSource own;
  if (named.offer() != Answer::accepted) return "the server opens no datagrams";
  named.begin(own);
  if (!named.open(kPatience)) return "no association";
  named.readOn();
  OfferingPeer unknown(target);
  if (unknown.offer() != Answer::accepted) return "the server opens no datagrams";
  const std::array checks{named.wrongCheck(), unknown.wrongCheck()};
  // The server forgets the user name of this offer.
  if (unknown.offer() != Answer::accepted) return "the server opens no datagrams";

  std::vector<std::unique_ptr<UdpSource>> sources;
  for (std::size_t i = 0; i < kFlooders * kPorts; ++i) sources.push_back(std::make_unique<UdpSource>());
  std::atomic<std::uint64_t> sent = 0;
  std::jthread strangers([&] {
    sent = flood(target, [&](int i) {
      thread_local std::size_t next = 0;
      UdpSource& source = *sources[static_cast<std::size_t>(i) * kPorts + ++next % kPorts];
      source.send(named.server(), checks[next % checks.size()]);
    });
  });
  std::uint64_t asked = 0;
  const std::uint64_t before = named.answers();
  repeat(target, [&] {
    own.send(named.server(), named.check(true));
    ++asked;
    named.step(50ms);
    std::this_thread::sleep_for(5ms);  // far below the rate of a peer
  });
  strangers.join();
  named.step(100ms);
  const std::uint64_t answered = named.answers() - before;
  std::uint64_t answers = 0;
  for (const auto& source : sources)
    while (source->receive()) ++answers;
  return fmt::format("{} checks sent, {} answers; the peer's own {} checks: {}, {} times", sent.load(),
                     answers, asked, 2 * answered >= asked ? "answered" : "starved", answered);
}

std::string floodOffers(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  for (int i = 0; i < kFlooders; ++i) joined.push_back(std::make_unique<Joined>(*stub, ""));
  const ice::Credentials own = ice::randomCredentials();
  v1::ClientMessage offer;
  offer.mutable_datagram_offer()->set_ufrag(own.ufrag);
  offer.mutable_datagram_offer()->set_password(own.password);
  offer.mutable_datagram_offer()->set_fingerprint(std::string(32, 'x'));
  const std::uint64_t sent = flood(target, [&](int i) {
    if (!joined[static_cast<std::size_t>(i)]->send(offer)) std::this_thread::sleep_for(1ms);
    std::this_thread::sleep_for(10ms);
  });
  return fmt::format("{} offers sent; {}", sent, joined.front()->lastError());
}

// Offers whose handshakes begin and never end, again and again.
std::string beginHandshakes(const Target& target) {
  constexpr std::size_t kPeersOfEach = 6;
  struct Half {
    explicit Half(const Target& target) : peer(target) {}
    UdpSource source;  // outlives the association
    OfferingPeer peer;
  };
  std::vector<std::unique_ptr<Half>> halves;
  for (std::size_t i = 0; i < kFlooders * kPeersOfEach; ++i) halves.push_back(std::make_unique<Half>(target));
  std::atomic<std::uint64_t> offers = 0, begun = 0;
  flood(target, [&](int i) {
    thread_local std::size_t next = 0;
    std::this_thread::sleep_for(20ms);  // less than 10 offers a second of each peer, which the server accepts
    Half& half = *halves[static_cast<std::size_t>(i) * kPeersOfEach + next++ % kPeersOfEach];
    if (half.peer.offer() != Answer::accepted) return;
    ++offers;
    half.peer.begin(half.source);
    const std::uint64_t before = half.source.receivedRecords();
    const auto end = Clock::now() + 100ms;
    while (half.source.receivedRecords() == before && Clock::now() < end) half.peer.step(5ms, false);
    if (half.source.receivedRecords() > before) ++begun;
  });
  return fmt::format("{} offers accepted, {} handshakes begun", offers.load(), begun.load());
}

// Payloads of one kind.
class PayloadFlood {
 public:
  PayloadFlood(OfferingPeer& peer, int kind)
      : peer_(peer), kind_(kind), random_(static_cast<unsigned>(kind)) {}

  void send() {
    std::array<std::byte, datagram::kMaxDatagramBytes> bytes;
    switch (kind_ % 4) {
      case 0:  // requests for all pieces of the newest frames
        return peer_.send(std::span(bytes).first(datagram::writeRequest(
            {.frame = static_cast<std::uint32_t>(random_() % 512), .present = {}}, bytes)));
      case 1: {  // receipts that nothing is lost, and others of packets that were never sent
        const std::uint32_t newest =
            random_() % 8 == 0 ? static_cast<std::uint32_t>(random_()) : peer_.newestPacket().value_or(0);
        return peer_.send(std::span(bytes).first(
            datagram::writeReceipt({.newest = newest, .arrivalUs = 0, .before = ~std::uint64_t{0}}, bytes)));
      }
      case 2: {
        std::vector<std::byte> any = randomBytes(random_, 1 + random_() % bytes.size());
        any[0] = static_cast<std::byte>(random_() % 6);
        return peer_.send(any);
      }
      default: {
        v1::ClientMessage poses;
        v1::ParticipantCollider& pose = *poses.mutable_collider_poses()->add_colliders();
        pose.set_id(1);
        pose.mutable_pose()->mutable_position()->set_y(1e-6f * static_cast<float>(random_() % 1'000'000));
        pose.mutable_pose()->mutable_orientation()->set_w(1);
        pose.mutable_sphere()->set_radius(0.05f);
        peer_.sendInput(poses);
        return std::this_thread::sleep_for(1ms);
      }
    }
  }

 private:
  OfferingPeer& peer_;
  const int kind_;
  std::mt19937 random_;
};

// Two participants each flood requests, receipts, random payloads, and 1,000 poses a second.
std::string floodPayloads(const Target& target) {
  struct Flooder {
    explicit Flooder(const Target& target) : peer(target) {}
    UdpSource source;
    OfferingPeer peer;
  };
  std::array<std::unique_ptr<Flooder>, kFlooders> flooders;
  std::array<std::unique_ptr<PayloadFlood>, kFlooders> floods;
  for (std::size_t i = 0; i < flooders.size(); ++i) {
    flooders[i] = std::make_unique<Flooder>(target);
    floods[i] = std::make_unique<PayloadFlood>(flooders[i]->peer, static_cast<int>(i));
    if (flooders[i]->peer.offer() != Answer::accepted) return "the server opens no datagrams";
    flooders[i]->peer.begin(flooders[i]->source);
    if (!flooders[i]->peer.open(kPatience)) return "no association";
    flooders[i]->peer.readOn();
  }
  // Twice the rate of a peer: beyond that, its own checks would be lost, and with them the association.
  constexpr int kInARow = 20;
  const std::uint64_t rounds = flood(target, [&](int i) {
    const auto number = static_cast<std::size_t>(i);
    for (int payload = 0; payload < kInARow; ++payload) floods[number]->send();
    flooders[number]->peer.step();
    std::this_thread::sleep_for(5ms);
  });
  std::uint64_t most = 0;
  for (const auto& flooder : flooders) most = std::max(most, flooder->source.receivedBytes());
  std::string ends;
  for (std::size_t i = 0; i < flooders.size(); ++i)
    if (const auto end = flooders[i]->peer.end()) ends += fmt::format("; stream {}: {}", i, *end);
  return fmt::format("{} payloads sent; {} kB a second to one peer at most{}", rounds * kInARow,
                     most / 1000 / static_cast<std::uint64_t>(target.time.count()), ends);
}

// Everything that a participant can send from an address at which it never answers a check.
std::string amplify(const Target& target) {
  std::vector<std::unique_ptr<OfferingPeer>> peers;
  for (int i = 0; i < kFlooders; ++i) {
    peers.push_back(std::make_unique<OfferingPeer>(target));
    if (peers.back()->offer() != Answer::accepted) return "the server opens no datagrams";
  }
  std::array<std::unique_ptr<UdpSource>, kFlooders> sources;
  for (auto& source : sources) source = std::make_unique<UdpSource>();
  flood(target, [&](int i) {
    thread_local std::mt19937 random(static_cast<unsigned>(i));
    UdpSource& source = *sources[static_cast<std::size_t>(i)];
    const OfferingPeer& peer = *peers[static_cast<std::size_t>(i)];
    source.send(peer.server(), peer.check(random() % 2 == 0));
    std::vector<std::byte> record = randomBytes(random, 1200);
    record[0] = std::byte{22};  // a handshake of DTLS
    if (random() % 16 == 0) source.send(peer.server(), record);
    while (source.receive()) {
    }
    std::this_thread::sleep_for(5ms);
  });
  std::this_thread::sleep_for(300ms);  // the server repeats its checks
  std::uint64_t sent = 0, got = 0, records = 0;
  for (const auto& source : sources) {
    while (source->receive()) {
    }
    sent += source->sentBytes();
    got += source->receivedBytes();
    records += source->receivedRecords();
  }
  return fmt::format("{} came back, {} datagrams other than checks", shareOf(got, sent), records);
}

// A participant with an open association, to which frames flow, sends checks that seem to come from another
// machine: here, from a socket that answers nothing.
std::string aimAtOthers(const Target& target) {
  UdpSource own, other;
  OfferingPeer peer(target);
  if (peer.offer() != Answer::accepted) return "the server opens no datagrams";
  peer.begin(own);
  if (!peer.open(kPatience)) return "no association";
  peer.readOn();
  repeat(target, [&] {
    other.send(peer.server(), peer.check(true));
    while (other.receive()) {
    }
    peer.step(5ms);
  });
  std::this_thread::sleep_for(300ms);
  while (other.receive()) {
  }
  return fmt::format("the participant got {} datagrams, the other address {}; {} came to it",
                     own.receivedRecords() > 0 ? "its" : "no", other.receivedRecords(),
                     shareOf(other.receivedBytes(), other.sentBytes()));
}

constexpr Attack kAttacksDatagram[] = {
    {.name = "udp_flood",
     .description = "send random datagrams to the UDP port without end",
     .perform = &floodPort,
     .expected = "[1-9][0-9]* datagrams sent, 0 answers",
     .datagrams = true},
    {.name = "wrong_checks",
     .description = "send checks without the password from 256 ports, half of them with a peer's user name",
     .perform = &floodWrongChecks,
     .expected = "[1-9][0-9]* checks sent, 0 answers; the peer's own [0-9]+ checks: answered.*",
     .datagrams = true},
    {.name = "datagram_offers",
     .description = "offer datagrams from eight streams without end",
     .perform = &floodOffers,
     .expected = "[1-9][0-9]* offers sent; too many offers of datagrams.*",
     .datagrams = true},
    {.name = "half_associations",
     .description = "offer datagrams from 48 streams, and begin handshakes that never end",
     .perform = &beginHandshakes,
     .expected = "[1-9][0-9]* offers accepted, [1-9][0-9]* handshakes begun",
     .datagrams = true},
    {.name = "payload_floods",
     .description = "flood requests, wrong receipts, random payloads and poses over eight associations",
     .perform = &floodPayloads,
     .expected = "[1-9][0-9]* payloads sent; .*",
     .datagrams = true},
    {.name = "amplification",
     .description = "send valid checks from addresses that answer none",
     .perform = &amplify,
     .expected = "at most three times the bytes .* came back, 0 datagrams other than checks",
     .datagrams = true},
    {.name = "aimed_datagrams",
     .description = "nominate the address of another machine for one's own datagrams",
     .perform = &aimAtOthers,
     .expected = "the participant got its datagrams, the other address 0; at most three times the bytes .*",
     .datagrams = true},
};

}  // namespace

std::span<const Attack> datagramAttacks() {
  return kAttacksDatagram;
}

}  // namespace clothstream::attack
