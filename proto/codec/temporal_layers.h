// SPDX-License-Identifier: MIT
// Temporal layers: which frames can be dropped without harm to others, and which are held as references.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

// Layer of a frame, counted from the key frame. Each layer above the base has the frames half-way between
// those below it. Three layers give 0 2 1 2, repeated.
constexpr std::uint8_t layerOf(std::uint64_t frame, std::uint8_t layers) {
  const std::uint64_t place = frame & ((std::uint64_t{1} << (layers - 1)) - 1);
  return place == 0 ? std::uint8_t{0} : static_cast<std::uint8_t>(layers - 1 - std::countr_zero(place));
}

// Newest frame of each layer since the last key frame, by tick. Both ends hold these frames. A reader that
// missed a frame does not hold it, and is sent nothing that refers to it.
class HeldFrames {
 public:
  void clear() { ticks_ = {}; }
  void hold(std::uint8_t layer, std::uint64_t tick) { ticks_[layer] = tick; }
  std::optional<std::uint64_t> tick(std::uint8_t layer) const { return ticks_[layer]; }

  // Layer whose newest frame has this tick.
  std::optional<std::uint8_t> find(std::uint64_t tick) const {
    for (std::uint8_t layer = 0; layer < kMaxTemporalLayers; ++layer) {
      if (ticks_[layer] == tick) return layer;
    }
    return std::nullopt;
  }

  // Layer whose newest frame is the reference of a frame of `layer`: the newest of the lower layers. The base
  // refers to itself.
  std::uint8_t referenceOf(std::uint8_t layer) const {
    std::uint8_t newest = 0;
    for (std::uint8_t other = 1; other < layer; ++other) {
      if (ticks_[other] > ticks_[newest]) newest = other;
    }
    return newest;
  }

 private:
  std::array<std::optional<std::uint64_t>, kMaxTemporalLayers> ticks_;
};

}  // namespace clothstream::codec
