// SPDX-License-Identifier: MIT
// When a client that was cut off tries again.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace clothstream::client {

// A link that returns is to be noticed at once, for as long as the server may hold the participant: attempts
// are at most kLongestHeldUs apart. After that a server is not to be hurried: at most kLongestUs. Delays grow
// from kShortestUs, and are jittered by up to a half, so that those who were cut off together do not come
// back together. All times are microseconds.
class Reconnection {
 public:
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
  static constexpr std::uint64_t kShortestUs = 50'000, kLongestHeldUs = 120'000, kLongestUs = 5'000'000;
  // An attempt that has led to no Welcome by then is given up for another: soon while the participant is
  // held, for a link that returns may have swallowed its beginning; else slow links have their time.
  static constexpr std::uint64_t kHeldAttemptUs = 2'000'000, kAttemptUs = 10'000'000;
  // A connection that brings nothing for this long is given up: servers answer pings. Of the time between two
  // updates this much counts at most.
  static constexpr std::uint64_t kSilenceUs = 4'000'000, kLongestStepUs = 500'000;
  // A connection that held this long was a good one: the first attempt after it comes at once.
  static constexpr std::uint64_t kStableUs = 2'000'000;

  // When to try again. `seed` differs from client to client.
  std::uint64_t lost(std::uint64_t nowUs, std::uint64_t holdUs, std::uint64_t seed) {
    if (joinedUs_ && nowUs - joinedUs_ >= kStableUs) attempts_ = 0;
    if (attempts_ == 0) lostUs_ = nowUs;
    joinedUs_ = 0;
    ++attempts_;
    const std::uint64_t longest = isHeld(nowUs, holdUs) ? kLongestHeldUs : kLongestUs;
    const std::uint64_t delay =
        attempts_ == 1 ? 0 : std::min(longest, kShortestUs << std::min(attempts_ - 2, 20u));
    return nowUs + delay - jitter(delay / 2, seed + attempts_);
  }
  // Until when an attempt that begins now is waited for.
  std::uint64_t attemptEnd(std::uint64_t nowUs, std::uint64_t holdUs) const {
    return nowUs + (isHeld(nowUs, holdUs) ? kHeldAttemptUs : kAttemptUs);
  }
  void joined(std::uint64_t nowUs) { joinedUs_ = std::max<std::uint64_t>(nowUs, 1); }

 private:
  bool isHeld(std::uint64_t nowUs, std::uint64_t holdUs) const {
    return attempts_ > 0 && nowUs - lostUs_ < holdUs;
  }

  // 0 to `most`: splitmix64 of the seed.
  static std::uint64_t jitter(std::uint64_t most, std::uint64_t seed) {
    seed += 0x9e3779b97f4a7c15u;
    seed = (seed ^ (seed >> 30)) * 0xbf58476d1ce4e5b9u;
    seed = (seed ^ (seed >> 27)) * 0x94d049bb133111ebu;
    return (seed ^ (seed >> 31)) % (most + 1);
  }

  std::uint32_t attempts_ = 0;
  std::uint64_t lostUs_ = 0, joinedUs_ = 0;  // 0: not
};

}  // namespace clothstream::client
