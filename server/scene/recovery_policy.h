// SPDX-License-Identifier: MIT
// Chooses how a scene continues after a tick whose state is not valid.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>

namespace clothstream::scene {

// Gives up as little as possible: first the newest second of motion, then the motion since the start, then
// what participants do to the cloth, and at last the newest changes of parameters.
//
// One set of parameters after another is the candidate: the caller keeps a copy of it. A candidate is proven
// when a second of valid ticks has passed since, also if the parameters have changed again meanwhile: a
// slider that changes them all the time must not keep older changes from being proven. Proven parameters are
// never given up, so at most the changes of the newest two seconds are, if no state is invalid meanwhile.
//
// Ticks are numbers that only grow. Not thread-safe.
class RecoveryPolicy {
 public:
  explicit RecoveryPolicy(std::uint32_t ticksPerSecond) : second_(ticksPerSecond) {}

  enum class Cure : std::uint8_t {
    rollback,       // to the newest valid state
    reset,          // of the cloths to their start
    resetAndLetGo,  // the same; colliders, grabs and moved attachments of participants are ignored for a
                    // second
    resetAndUndo,   // the same as reset; parameters go back to those that were proven
  };

  // Whether there is a candidate. If not, the next changed() makes the parameters of that time the candidate.
  bool hasCandidate() const { return candidate_.has_value(); }
  // The parameters have changed since `tick`.
  void changed(std::uint64_t tick) {
    if (candidate_)
      hasNewer_ = true;
    else
      candidate_ = tick;
  }
  // Returns whether the candidate has just been proven, by a valid `tick`. The present parameters are then
  // the next candidate, if they are newer.
  bool valid(std::uint64_t tick) {
    const std::uint64_t since = std::max(candidate_.value_or(tick), newest_);
    if (!candidate_ || tick - since < second_) return false;
    candidate_.reset();
    if (std::exchange(hasNewer_, false)) candidate_ = tick;
    return true;
  }
  // Cure for the state of `tick`, which is not valid. `touched`: participants act on the cloth.
  Cure invalid(std::uint64_t tick, bool touched) {
    const bool again = hasFailed_ && tick - newest_ <= second_;
    restore(tick);
    if (!again) return Cure::rollback;
    if (touched && !ignores(tick)) {
      ignoredUntil_ = tick + second_;
      return Cure::resetAndLetGo;
    }
    if (!candidate_) return Cure::reset;
    candidate_.reset();
    hasNewer_ = false;
    return Cure::resetAndUndo;
  }
  // Whether what participants do has no effect in the tick after `tick`.
  bool ignores(std::uint64_t tick) const { return tick < ignoredUntil_; }

  // Newest tick whose state was not valid.
  std::optional<std::uint64_t> newest() const { return hasFailed_ ? std::optional(newest_) : std::nullopt; }
  void restore(std::optional<std::uint64_t> newest) {
    hasFailed_ = newest.has_value();
    newest_ = newest.value_or(0);
  }

 private:
  const std::uint64_t second_;              // ticks
  std::optional<std::uint64_t> candidate_;  // tick since which it is one
  bool hasNewer_ = false;                   // the parameters have changed since then
  bool hasFailed_ = false;
  std::uint64_t newest_ = 0;  // tick of the newest failure
  std::uint64_t ignoredUntil_ = 0;
};

}  // namespace clothstream::scene
