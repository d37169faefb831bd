// SPDX-License-Identifier: MIT
// Limits the parameter changes of a scene, because each is announced to all of its participants.
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>

#include "server/schedule/token_bucket.h"

namespace clothstream::scene {

// Not thread-safe.
class ChangeLimits {
 public:
  // Changes of all participants together, and of one. Each burst is the number of one second.
  static constexpr double kPerSecond = 240, kOfParticipantPerSecond = kPerSecond / 4;
  // Bytes of their announcements, for each receiver. The burst holds several seconds, because a single change
  // of many cloths has tens of kilobytes.
  static constexpr double kBytesPerSecond = 128 * 1024, kOfParticipantBytesPerSecond = kBytesPerSecond / 2;
  static constexpr double kBurstBytes = 4 * kBytesPerSecond, kOfParticipantBurstBytes = kBurstBytes / 2;

  enum class Exceeded : std::uint8_t { nothing, byParticipant, byAll };

  // Counts a change by this participant; peers outside of the scene share number 0.
  Exceeded count(std::uint64_t participant, schedule::Clock::time_point now) {
    for (auto known = buckets_.begin(); known != buckets_.end();)
      known = known->second.areFull(now) ? buckets_.erase(known) : std::next(known);
    if (!buckets_[participant].changes.take(now)) return Exceeded::byParticipant;
    return all_.changes.take(now) ? Exceeded::nothing : Exceeded::byAll;
  }
  // Counts the bytes of its announcement, at most kOfParticipantBurstBytes. Call it after count().
  Exceeded countBytes(std::uint64_t participant, std::size_t bytes, schedule::Clock::time_point now) {
    const auto cost = static_cast<double>(bytes);
    if (!buckets_[participant].bytes.take(now, cost)) return Exceeded::byParticipant;
    return all_.bytes.take(now, cost) ? Exceeded::nothing : Exceeded::byAll;
  }

 private:
  struct Buckets {
    schedule::TokenBucket changes{kOfParticipantPerSecond, kOfParticipantPerSecond},
        bytes{kOfParticipantBytesPerSecond, kOfParticipantBurstBytes};
    bool areFull(schedule::Clock::time_point now) { return changes.isFull(now) && bytes.isFull(now); }
  };

  Buckets all_{.changes{kPerSecond, kPerSecond}, .bytes{kBytesPerSecond, kBurstBytes}};
  std::map<std::uint64_t, Buckets> buckets_;  // by participant; full ones are removed
};

}  // namespace clothstream::scene
