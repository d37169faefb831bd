// SPDX-License-Identifier: MIT
// Round trip and offset of the server's clock from pings and their pongs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "clients/core/server_message.h"

namespace clothstream::client {

// A ping's server time was true somewhere between its sending and its pong: the offset is known to half a
// round trip. Queues only ever lengthen a round trip, so the shortest of the last ones is believed.
class ServerClock {
 public:
  bool pingDue(std::uint64_t nowUs) const;
  void pingSent(std::uint64_t nowUs);
  // A pong that answers none of the last pings is left aside.
  void pongReceived(const Pong& pong, std::uint64_t nowUs);

  // 0 before the first pong.
  double roundTripMs() const;
  double offsetUs() const;  // server's - own

 private:
  static constexpr std::size_t kWindow = 16;
  static constexpr std::uint64_t kFirstIntervalUs = 100'000, kIntervalUs = 500'000;

  struct Exchange {
    std::uint64_t roundTripUs = 0;
    double offsetUs = 0;
  };

  const Exchange* best() const;

  std::uint64_t pings_ = 0, lastPingUs_ = 0;
  std::array<std::uint64_t, kWindow> unanswered_{};  // client times; 0: answered
  std::array<Exchange, kWindow> exchanges_{};
  std::size_t exchangeCount_ = 0;
};

}  // namespace clothstream::client
