// SPDX-License-Identifier: MIT
// Two DTLS channels with a link between them, in simulated time.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/dtls/dtls_channel.h"
#include "tests/dtls/simulated_clock.h"

namespace clothstream::dtls {

using Bytes = std::vector<std::byte>;

struct End {
  std::unique_ptr<DtlsChannel> channel;
  std::vector<Bytes> received;
  std::function<void(DtlsChannel&)> onPayload;
};

class SimulatedLink {
 public:
  // When a datagram with this number, from 0, arrives after it was sent: no time, one or several.
  using Fate = std::function<std::vector<std::chrono::milliseconds>(std::size_t number)>;

  explicit SimulatedLink(Fate fate = {}) : fate_(std::move(fate)) {}

  // The fingerprints that the ends expect of each other. They are right unless the test changes them.
  std::string expectedOfClient = clientCertificate().fingerprint();
  std::string expectedOfServer = serverCertificate().fingerprint();
  End client, server;

  static const Certificate& clientCertificate() { return *identities().first; }
  static const Certificate& serverCertificate() { return *identities().second; }
  static const DtlsContext& clientContext() {
    static const DtlsContext context(clientCertificate());
    return context;
  }
  static const DtlsContext& serverContext() {
    static const DtlsContext context(serverCertificate());
    return context;
  }

  void start() {
    server.channel = make(serverContext(), Role::server, expectedOfClient, client, server);
    client.channel = make(clientContext(), Role::client, expectedOfServer, server, client);
  }

  // Runs until nothing is left to do, or the time has passed.
  void run(std::chrono::milliseconds time) {
    const Time end = simulatedNow() + time;
    while (true) {
      Time next = std::min(client.channel->nextTime(), server.channel->nextTime());
      for (const Flight& flight : flights_) next = std::min(next, flight.arrives);
      if (next > end) break;
      simulatedNow() = std::max(simulatedNow(), next);
      deliver();
      client.channel->advance(simulatedNow());
      server.channel->advance(simulatedNow());
    }
    simulatedNow() = end;
  }
  bool isOpen() const {
    return client.channel->state() == DtlsChannel::State::open &&
           server.channel->state() == DtlsChannel::State::open;
  }
  // Number of datagrams that were sent, and each of them.
  const std::vector<Bytes>& sent() const { return sent_; }

 private:
  struct Flight {
    Bytes datagram;
    End* to;
    Time arrives;
  };

  static const std::pair<std::unique_ptr<Certificate>, std::unique_ptr<Certificate>>& identities() {
    static const auto made = std::pair(std::make_unique<Certificate>(), std::make_unique<Certificate>());
    return made;
  }

  std::unique_ptr<DtlsChannel> make(const DtlsContext& context, Role role, const std::string& expected,
                                    End& other, End& own) {
    const auto send = [this, &other](std::span<const std::byte> datagram) {
      const std::size_t number = sent_.size();
      sent_.emplace_back(datagram.begin(), datagram.end());
      for (const auto delay :
           fate_ ? fate_(number) : std::vector<std::chrono::milliseconds>{std::chrono::milliseconds(25)})
        flights_.push_back({sent_.back(), &other, simulatedNow() + delay});
    };
    const auto receive = [&own](std::span<const std::byte> payload) {
      own.received.emplace_back(payload.begin(), payload.end());
      if (own.onPayload) own.onPayload(*own.channel);
    };
    return std::make_unique<DtlsChannel>(
        context, role, expected, DtlsChannel::Callbacks{.send = send, .receive = receive}, simulatedNow());
  }

  void deliver() {
    for (std::size_t i = 0; i < flights_.size();) {
      if (flights_[i].arrives > simulatedNow()) {
        ++i;
        continue;
      }
      const Flight flight = std::move(flights_[i]);
      flights_.erase(flights_.begin() + static_cast<std::ptrdiff_t>(i));
      flight.to->channel->handle(flight.datagram, simulatedNow());
    }
  }

  const Fate fate_;
  std::vector<Flight> flights_;
  std::vector<Bytes> sent_;
};

}  // namespace clothstream::dtls
