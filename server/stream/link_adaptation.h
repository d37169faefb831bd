// SPDX-License-Identifier: MIT
// How much of a stream one subscriber is sent, by what its link carries.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "proto/codec/stream_layout.h"
#include "server/stream/clock.h"

namespace clothstream::stream {

// Of what a stream comes in: a quality, and so many temporal layers of it, from the base on.
struct OperatingPoint {
  std::uint8_t quality = 0;
  std::uint8_t layers = 1;
  bool operator==(const OperatingPoint&) const = default;
};

// Steps from all that a subscriber wants down to the base layer of the coarsest quality: layers go first,
// then quality. It is told with every frame whether the subscriber is behind. What it is behind adds up, and
// what it is not takes half as much away: a single hiccup counts for little.
//
// Down: when kPatience has added up, to the best point that what was delivered meanwhile would have carried.
// Up: a step at a time, after a time in which it was hardly behind. After one that fails within kTrial
// the next waits twice as long, but never longer than that from the lowest point to the best takes 3 s. With
// one point alone nothing ever changes. Not thread-safe; knows no clock but what it is told.
class LinkAdaptation {
 public:
  static constexpr std::chrono::milliseconds kPatience{200}, kTrial{1000};
  // Before the first step up after one down; after one up that went well.
  static constexpr std::chrono::milliseconds kShortestWait{500}, kLongestWait{1500}, kClimb{250};
  // What frames that were dropped count for, however many at a time.
  static constexpr std::chrono::milliseconds kOfDrop{100};
  // Of the bits of a quality the next coarser one takes about this part: less of calm cloth, more of a flag.
  static constexpr double kPartOfFiner = 0.7;

  // Of a stream in `qualities`, of which `best` is wanted at most.
  LinkAdaptation(OperatingPoint best, std::uint8_t qualities);

  const OperatingPoint& point() const { return points_[step_]; }

  // A frame of the stream that the subscriber is sent was made; of a layer that it may not get.
  void made(std::uint8_t quality, std::uint8_t layer, std::size_t bytes, Clock::time_point now);
  // So many bytes arrived.
  void delivered(std::size_t bytes) { delivered_ += bytes; }
  // Frames that it was to get were dropped, for they waited too long.
  void dropped(Clock::time_point now) { strain(kOfDrop, now); }
  // At least with each frame that is made: whether something waits for the subscriber. Returns whether the
  // point is another one now.
  bool look(bool behind, Clock::time_point now);

 private:
  // From this time on, where it begins.
  void strain(Clock::duration more, Clock::time_point since);
  void stepDown(Clock::time_point now);
  void stepUp(Clock::time_point now);
  double bytesPerSecond(const OperatingPoint& point) const;

  std::vector<OperatingPoint> points_;  // the best first
  std::size_t step_ = 0;

  // Of each layer as it is made, bytes/s, of this quality.
  std::array<double, codec::kMaxTemporalLayers> rates_{};
  std::uint8_t ratesQuality_ = 0;
  std::optional<Clock::time_point> newestMade_;

  std::optional<Clock::time_point> newestLook_;
  Clock::duration strain_{}, calm_{};
  Clock::time_point strainedSince_{};
  std::size_t delivered_ = 0;  // since then
  Clock::duration wait_ = kShortestWait, backOff_ = kShortestWait;
  std::optional<Clock::time_point> steppedUp_;  // last
};

}  // namespace clothstream::stream
