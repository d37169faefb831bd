// SPDX-License-Identifier: MIT
// Count of the frames of a recording that cannot be shown as they were recorded.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace clothstream::recording {

// Every reader of recordings counts with this class, and fails if any() is true.
class FrameFaults {
 public:
  // Counts a frame that was decoded, or that repeats the frame before it.
  void addGood() {
    ++frames_;
    isBroken_ = false;
  }
  // Counts a frame that the decoder refused, or that may not follow. `tick` is that of its header, if it has
  // one.
  void addUndecodable(std::optional<std::uint64_t> tick, double seconds) {
    ++undecodable_;
    add(tick, seconds);
  }
  // Counts a frame that was decoded to other positions than it states.
  void addDifferent(std::uint64_t tick, double seconds) {
    ++different_;
    add(tick, seconds);
    isBroken_ = true;
  }
  // Returns false for the frames after one that differs, up to the next key frame, because they refer to it.
  // The caller does not decode such a frame and counts it with addUndecodable().
  bool mayFollow(bool isKey) const { return isKey || !isBroken_; }

  bool any() const { return undecodable_ + different_ > 0; }
  std::uint64_t frames() const { return frames_; }
  std::uint64_t undecodable() const { return undecodable_; }
  std::uint64_t different() const { return different_; }
  // The first frame with a fault. Its tick is absent if its header cannot be read.
  std::optional<std::uint64_t> firstTick() const { return firstTick_; }
  double firstSeconds() const { return firstSeconds_; }

  // Names a frame by its tick and its time since the start of the recording.
  static std::string nameOf(std::optional<std::uint64_t> tick, double seconds) {
    const auto milliseconds = static_cast<std::uint64_t>(seconds <= 0 ? 0 : seconds * 1000 + 0.5);
    const std::string fraction = std::to_string(1000 + milliseconds % 1000).substr(1);
    return (tick ? "tick " + std::to_string(*tick) : std::string("an unknown tick")) + " at " +
           std::to_string(milliseconds / 1000) + "." + fraction + " s";
  }
  // Describes all faults in one sentence without a full stop; empty without any.
  std::string text() const {
    if (!any()) return {};
    std::string what;
    if (undecodable_ > 0) what += std::to_string(undecodable_) + " cannot be decoded";
    if (undecodable_ > 0 && different_ > 0) what += " and ";
    if (different_ > 0) what += std::to_string(different_) + " differ from their recorded hash";
    return "of " + std::to_string(frames_) + " frames " + what + ", the first is that of " +
           nameOf(firstTick_, firstSeconds_);
  }

 private:
  void add(std::optional<std::uint64_t> tick, double seconds) {
    ++frames_;
    if (undecodable_ + different_ > 1) return;
    firstTick_ = tick;
    firstSeconds_ = seconds;
  }

  std::uint64_t frames_ = 0, undecodable_ = 0, different_ = 0;
  std::optional<std::uint64_t> firstTick_;
  double firstSeconds_ = 0;
  bool isBroken_ = false;  // a frame differed, and none was good since then
};

}  // namespace clothstream::recording
