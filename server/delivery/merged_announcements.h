// SPDX-License-Identifier: MIT
// Merges announcements that a subscriber has not read yet.
#pragma once

#include <cstddef>
#include <deque>
#include <utility>
#include <vector>

#include "server/delivery/envelope.h"

namespace clothstream::delivery {

// Contact and grab events that merged announcements keep; the oldest are dropped.
inline constexpr std::size_t kMaxMergedEvents = 256;

// Returns fewer announcements that lead a client to the same state as all of these, in the order of the
// newest part of each:
// - all changes of parameters become one, with tick and participant of the newest;
// - of each participant the newest presence stays; one that joined and left is omitted;
// - of each kind of notice the newest stays, and of opposites (paused and resumed) the newest of both;
// - of each grab, and of each contact of a collider and a cloth, the newest event stays;
// - of every other kind of message the newest stays.
// The size of the result depends on what the scene contains, not on the number of announcements.
// The time is in proportion to the size of all announcements together.
std::deque<SharedBytes> merged(const std::deque<SharedBytes>& announcements);

// Merges for all subscribers of one announcement. Subscribers that have read nothing for equally long hold
// the same announcements. Those are merged once, and the results share their messages. Not thread-safe.
class SharedMerges {
 public:
  // Same as merged(). The result stays valid until the next call.
  const std::deque<SharedBytes>& of(const std::deque<SharedBytes>& announcements);
  // Number of merges that were computed.
  std::size_t computed() const { return merges_.size(); }

 private:
  struct Merge {
    Merge(std::deque<SharedBytes> before, std::deque<SharedBytes> after)
        : from(std::move(before)), to(std::move(after)) {}
    std::deque<SharedBytes> from, to;
  };
  std::vector<Merge> merges_;
};

}  // namespace clothstream::delivery
