// SPDX-License-Identifier: MIT
// Estimates the server's clock from pings and pongs.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "clients/core/wire/server_message.h"

namespace clothstream::client {

// Difference of two times of an unsigned clock; negative if `now` is earlier.
constexpr double since(std::uint64_t before, std::uint64_t now) {
  return static_cast<double>(static_cast<std::int64_t>(now - before));
}

// The server read its clock between the sending of a ping and the arrival of its pong. The offset is
// therefore within half a round trip of the middle. Queues only lengthen round trips, so the estimate uses
// the exchanges with the shortest quarter of the round trips of the last minutes. A line through their
// offsets gives offset and drift. Jitter averages out, and single slow exchanges are ignored. A constant
// difference between the two directions cannot be measured: half of it remains as an error.
//
// An exchange that contradicts the line by more than kToleranceUs is suspect. After kSuspects suspect
// exchanges in a row, one of the clocks has jumped, and the estimate starts again from them.
class ServerClock {
 public:
  bool pingDue(std::uint64_t nowUs) const;
  void pingSent(std::uint64_t nowUs);
  // Ignores a pong that answers none of the last pings.
  void pongReceived(const Pong& pong, std::uint64_t nowUs);

  // Whether a pong arrived.
  bool known() const { return !exchanges_.empty(); }
  // Minimum of the last kRecent round trips; 0 before the first pong.
  double roundTripMs() const;
  // Server's clock minus own clock at this time; 0 before the first pong. The offset moves towards the
  // estimate by at most kSlew of the elapsed time, so that server times never go back. It jumps if the
  // difference exceeds kJumpUs.
  double offsetUs(std::uint64_t nowUs) const;
  // Server's clock at this time of the own clock; 0 before the first pong.
  std::uint64_t serverTimeUs(std::uint64_t nowUs) const;

  static constexpr double kSlew = 0.02, kJumpUs = 50'000;

 private:
  static constexpr std::size_t kPending = 64, kRecent = 16, kMaxExchanges = 1024, kSuspects = 4;
  static constexpr std::uint64_t kFirstIntervalUs = 10'000, kIntervalUs = 250'000;
  static constexpr double kWindowUs = 240e6;
  static constexpr std::size_t kBurst = 64;  // fast pings at the start and after a jump
  static constexpr double kToleranceUs = 5'000;
  static constexpr double kDrift = 20e-6;  // typical drift between quartz clocks

  struct Exchange {
    std::uint64_t atUs = 0;  // middle of the round trip, own clock
    std::uint64_t roundTripUs = 0;
    double offsetUs = 0;
  };
  // Offset at a time, and its growth per microsecond.
  struct Line {
    std::uint64_t atUs = 0;
    double offsetUs = 0, slope = 0;
    double at(std::uint64_t nowUs) const;
  };

  bool contradicts(const Exchange& exchange) const;
  void add(const Exchange& exchange);
  void fit();

  std::uint64_t lastPingUs_ = 0;
  bool pinged_ = false;
  std::size_t burst_ = kBurst;                     // fast pings that remain
  std::array<std::uint64_t, kPending> pending_{};  // client times; 0 if answered
  std::size_t nextPending_ = 0;
  std::deque<Exchange> exchanges_;    // oldest first
  std::vector<Exchange> suspects_;    // since the newest accepted exchange
  std::vector<std::uint64_t> trips_;  // scratch of fit()
  Line line_;
  // Last offset that was returned at a pong; the slew starts from it.
  std::uint64_t shownAtUs_ = 0;
  double shownUs_ = 0;
};

}  // namespace clothstream::client
