// SPDX-License-Identifier: MIT
// Schedules reconnects after a lost connection.
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace clothstream::client {

// Exponential back-off with jitter. Delays start at kShortestUs and double. During the server's reconnect
// grace period they are at most kLongestInGraceUs, so that a working network is noticed at once; later at
// most kLongestUs. Up to half of each delay is subtracted at random, so that clients that lost their
// connection together return at different times. All times are microseconds. The grace period (graceUs) is
// Welcome.hold_ms.
class Reconnection {
 public:
  static constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();
  static constexpr std::uint64_t kShortestUs = 50'000, kLongestInGraceUs = 120'000, kLongestUs = 5'000'000;
  // Time limit of an attempt without Welcome. It is short in the grace period, because a recovering network
  // may have lost the first packets. Later it leaves time for slow networks.
  static constexpr std::uint64_t kGraceAttemptUs = 2'000'000, kAttemptUs = 10'000'000;
  // A connection without any message for kSilenceUs is closed; servers answer pings. Frames do not count if
  // the server has answered an offer of datagrams, because they may come by these. At most kLongestStepUs of
  // the time between two updates counts.
  static constexpr std::uint64_t kSilenceUs = 4'000'000, kLongestStepUs = 500'000;
  // After a connection that lasted this long, the first attempt is immediate.
  static constexpr std::uint64_t kStableUs = 2'000'000;

  // Returns when to try again. `seed` must differ between clients.
  std::uint64_t lost(std::uint64_t nowUs, std::uint64_t graceUs, std::uint64_t seed) {
    if (joinedUs_ && nowUs - joinedUs_ >= kStableUs) attempts_ = 0;
    if (attempts_ == 0) lostUs_ = nowUs;
    joinedUs_ = 0;
    ++attempts_;
    const std::uint64_t longest = inGracePeriod(nowUs, graceUs) ? kLongestInGraceUs : kLongestUs;
    const std::uint64_t delay =
        attempts_ == 1 ? 0 : std::min(longest, kShortestUs << std::min(attempts_ - 2, 20u));
    return nowUs + delay - jitter(delay / 2, seed + attempts_);
  }
  // Returns the time limit of an attempt that starts now.
  std::uint64_t attemptEnd(std::uint64_t nowUs, std::uint64_t graceUs) const {
    return nowUs + (inGracePeriod(nowUs, graceUs) ? kGraceAttemptUs : kAttemptUs);
  }
  void joined(std::uint64_t nowUs) { joinedUs_ = std::max<std::uint64_t>(nowUs, 1); }

 private:
  bool inGracePeriod(std::uint64_t nowUs, std::uint64_t graceUs) const {
    return attempts_ > 0 && nowUs - lostUs_ < graceUs;
  }

  // Pseudo-random number from 0 to `most`: splitmix64 of the seed.
  static std::uint64_t jitter(std::uint64_t most, std::uint64_t seed) {
    seed += 0x9e3779b97f4a7c15u;
    seed = (seed ^ (seed >> 30)) * 0xbf58476d1ce4e5b9u;
    seed = (seed ^ (seed >> 27)) * 0x94d049bb133111ebu;
    return (seed ^ (seed >> 31)) % (most + 1);
  }

  std::uint32_t attempts_ = 0;
  std::uint64_t lostUs_ = 0, joinedUs_ = 0;  // joinedUs_ is 0 while not joined
};

}  // namespace clothstream::client
