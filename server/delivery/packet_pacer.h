// SPDX-License-Identifier: MIT
// Spreads the packets of a frame over time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <utility>

#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// Queue of packets that leave at a given rate, in their order; repeated ones leave before all others. A
// packet that leaves late, because a timer was late, does not delay those after it, up to kCatchUp.
//
// Not thread-safe. Reads no clock.
template <typename Packet>
class PacketPacer {
 public:
  static constexpr std::size_t kMost = 512;  // packets of either kind
  static constexpr std::chrono::milliseconds kCatchUp{2};

  // Returns false, and drops the packet, if kMost packets of its kind wait.
  [[nodiscard]] bool add(Packet packet, std::uint32_t bytes, bool repeated, Clock::time_point now) {
    std::deque<Waiting>& queue = repeated ? repeated_ : first_;
    if (queue.size() == kMost) return false;
    if (first_.empty() && repeated_.empty()) due_ = std::max(due_, now);
    queue.push_back({std::move(packet), bytes});
    bytes_ += bytes;
    return true;
  }

  // Takes the next packet if it is due. After a packet that was taken at the same `now`, one that is due
  // within `quantum` is taken, too. `rate`: bytes/s, above 0.
  std::optional<Packet> next(double rate, Clock::duration quantum, Clock::time_point now) {
    std::deque<Waiting>& queue = repeated_.empty() ? first_ : repeated_;
    const auto until = now == taken_ ? now + quantum : now;
    if (queue.empty() || until < due_) return std::nullopt;
    taken_ = now;
    Waiting taken = std::move(queue.front());
    queue.pop_front();
    bytes_ -= taken.bytes;
    due_ = std::max(due_, now - kCatchUp) +
           std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(taken.bytes / rate));
    return std::move(taken.packet);
  }
  // Time from which next() returns a packet; nothing if the queue is empty.
  std::optional<Clock::time_point> due() const {
    return first_.empty() && repeated_.empty() ? std::nullopt : std::optional(due_);
  }
  // Bytes that wait.
  std::uint64_t bytes() const { return bytes_; }
  // Drops the packets that wait.
  void clear() {
    first_.clear();
    repeated_.clear();
    bytes_ = 0;
  }

 private:
  struct Waiting {
    Packet packet;
    std::uint32_t bytes;
  };

  std::deque<Waiting> first_, repeated_;
  std::uint64_t bytes_ = 0;
  Clock::time_point due_{}, taken_{};  // of the next packet, and of the newest one
};

}  // namespace clothstream::delivery
