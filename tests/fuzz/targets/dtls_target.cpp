// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/dtls_target.h"

#include <algorithm>
#include <chrono>
#include <vector>

#include "proto/dtls/dtls_channel.h"

namespace clothstream::fuzz {
namespace {

using namespace std::chrono_literals;
using State = dtls::DtlsChannel::State;

constexpr int kMaxDatagrams = 64;
const dtls::Time kStart{1000s};

const dtls::Certificate& own() {
  static const dtls::Certificate certificate;
  return certificate;
}

const dtls::DtlsContext& context() {
  static const dtls::DtlsContext context(own());
  return context;
}

using Datagrams = std::vector<std::vector<std::byte>>;

// Two ends with an open association. Its handshake is recorded.
struct OpenAssociation {
  Datagrams ofClient, ofServer;
  dtls::DtlsChannel server{context(), dtls::Role::server, own().fingerprint(), into(ofServer), kStart};
  dtls::DtlsChannel client{context(), dtls::Role::client, own().fingerprint(), into(ofClient), kStart};

  OpenAssociation() {
    for (std::size_t up = 0, down = 0; up < ofClient.size() || down < ofServer.size();) {
      if (up < ofClient.size()) server.handle(std::vector(ofClient[up++]), kStart);
      if (down < ofServer.size()) client.handle(std::vector(ofServer[down++]), kStart);
    }
    require(server.state() == State::open && client.state() == State::open, "the handshake ends");
  }

 private:
  static dtls::DtlsChannel::Callbacks into(Datagrams& list) {
    return {.send = [&list](std::span<const std::byte> sent) { list.emplace_back(sent.begin(), sent.end()); },
            .receive = [](std::span<const std::byte>) { require(false, "strangers deliver no payloads"); }};
  }
};

// An association with a record that its receiver has not got.
struct Attacked {
  OpenAssociation association;
  Datagrams record;

  Attacked() {
    const std::vector<std::byte> payload(20);
    require(association.client.send(payload), "an open channel sends");
    record.push_back(association.ofClient.back());
  }
};

// Takes a big-endian number of two bytes. Returns false at the end of the input.
bool take(std::span<const std::byte>& input, unsigned& number) {
  if (input.size() < 2) return false;
  number = std::to_integer<unsigned>(input[0]) << 8 | std::to_integer<unsigned>(input[1]);
  input = input.subspan(2);
  return true;
}

std::span<const std::byte> take(std::span<const std::byte>& input, std::size_t size) {
  const auto taken = input.first(std::min(size, input.size()));
  input = input.subspan(taken.size());
  return taken;
}

// Calls `handle` with each datagram of the input. `right`: the datagrams that it may change.
template <typename Handle>
void forEachDatagram(std::span<const std::byte> input, const Datagrams& right, const Handle& handle) {
  unsigned word = 0;
  for (int i = 0; i < kMaxDatagrams && take(input, word); ++i) {
    constexpr unsigned kRight = 0x8000;
    if ((word & kRight) == 0) {
      handle(take(input, word % (2 * dtls::kMaxDatagramBytes)), true);
      continue;
    }
    std::vector<std::byte> datagram = right[(word & ~kRight) % right.size()];
    unsigned place = 0;
    if (!take(input, place)) return;
    const auto change = take(input, std::size_t{1});
    if (change.empty()) return;
    datagram[place % datagram.size()] ^= change[0];
    handle(datagram, change[0] != std::byte{0});
  }
}

void attackHandshake(dtls::Role role, std::span<const std::byte> input) {
  static const OpenAssociation recorded;
  dtls::DtlsChannel channel(
      context(), role, own().fingerprint(),
      {.send =
           [](std::span<const std::byte> sent) {
             require(sent.size() <= dtls::kHandshakeMtu, "datagrams of the handshake fit into the MTU");
           },
       .receive = [](std::span<const std::byte>) { require(false, "strangers deliver no payloads"); }},
      kStart);
  forEachDatagram(input, role == dtls::Role::server ? recorded.ofClient : recorded.ofServer,
                  [&](std::span<const std::byte> datagram, bool) {
                    channel.handle(datagram, kStart);
                    require(channel.state() != State::open, "a channel opens only for its peer");
                    require((channel.state() == State::failed) == !channel.error().empty(),
                            "a failure says why");
                  });
}

// The association stays open over all inputs.
void attackOpenAssociation(std::span<const std::byte> input) {
  static Attacked attacked;
  dtls::DtlsChannel& server = attacked.association.server;
  forEachDatagram(input, attacked.record, [&](std::span<const std::byte> datagram, bool foreign) {
    if (!foreign) return;
    server.handle(datagram, kStart);
    require(server.state() == State::open, "no stranger ends an open association");
  });
}

void run(std::span<const std::byte> input) {
  if (input.empty()) return;
  const auto form = std::to_integer<unsigned>(input[0]);
  if (form & 2) return attackOpenAssociation(input.subspan(1));
  attackHandshake(form & 1 ? dtls::Role::client : dtls::Role::server, input.subspan(1));
}

}  // namespace

const Target kDtlsTarget{.name = "dtls", .run = &run};

}  // namespace clothstream::fuzz
