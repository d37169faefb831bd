// SPDX-License-Identifier: MIT
// The server's clock, as pings and their pongs let it be known.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include "clients/core/wire/server_message.h"

namespace clothstream::client {

// Of two times of an unsigned clock: read as signed, the difference is right whichever is ahead.
constexpr double since(std::uint64_t before, std::uint64_t now) {
  return static_cast<double>(static_cast<std::int64_t>(now - before));
}

// A ping's server time was true somewhere between its sending and its pong: the offset lies within half a
// round trip of the middle. Queues only ever lengthen a round trip, so those exchanges are believed whose
// round trips are among the shortest quarter of the last minutes; a line through their offsets says where the
// server's clock is now, and how much faster it runs. Jitter averages out of it, and a single slow exchange
// is not among them. What differs between the two directions for good cannot be known: half of it stays as an
// error.
//
// An exchange that the line is not within, by more than kToleranceUs, is set aside. Where kSuspects in a row
// are, one of the clocks has stepped: what was known before is dropped.
class ServerClock {
 public:
  bool pingDue(std::uint64_t nowUs) const;
  void pingSent(std::uint64_t nowUs);
  // A pong that answers none of the last pings is left aside.
  void pongReceived(const Pong& pong, std::uint64_t nowUs);

  // Whether a pong came.
  bool known() const { return !exchanges_.empty(); }
  // The shortest of the last ones; 0 before the first pong.
  double roundTripMs() const;
  // Server's - own, at this time; 0 before the first pong. It comes nearer to what is known by
  // kSlew of the time that passes, so that what it maps own times to does not step back; but it jumps where
  // more than kJumpUs are missing.
  double offsetUs(std::uint64_t nowUs) const;
  // The server's clock at this time of the own one; 0 before the first pong.
  std::uint64_t serverTimeUs(std::uint64_t nowUs) const;

  static constexpr double kSlew = 0.02, kJumpUs = 50'000;

 private:
  static constexpr std::size_t kPending = 64, kRecent = 16, kMostExchanges = 1024, kSuspects = 4;
  static constexpr std::uint64_t kFirstIntervalUs = 10'000, kIntervalUs = 250'000;
  static constexpr double kWindowUs = 240e6;
  static constexpr std::size_t kBurst = 64;  // pings soon after each other, where nothing is known
  static constexpr double kToleranceUs = 5'000;
  static constexpr double kDrift = 20e-6;  // that quartz clocks commonly have between them

  struct Exchange {
    std::uint64_t atUs = 0;  // the middle, own clock
    std::uint64_t roundTripUs = 0;
    double offsetUs = 0;
  };
  // Offset at a time, and how much it grows a microsecond.
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
  std::size_t burst_ = kBurst;                     // pings that are still to come soon
  std::array<std::uint64_t, kPending> pending_{};  // client times; 0: answered
  std::size_t nextPending_ = 0;
  std::deque<Exchange> exchanges_;    // oldest first
  std::vector<Exchange> suspects_;    // since the newest that was believed
  std::vector<std::uint64_t> trips_;  // of fit()
  Line line_;
  // What was last told of: from there it slews.
  std::uint64_t shownAtUs_ = 0;
  double shownUs_ = 0;
};

}  // namespace clothstream::client
