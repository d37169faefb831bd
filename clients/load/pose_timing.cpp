// SPDX-License-Identifier: MIT
// Radii are multiples of a power of two, which floats represent exactly.
#include "clients/load/pose_timing.h"

#include <algorithm>
#include <cmath>

namespace clothstream::load {
namespace {

constexpr float kLeastRadius = 3.0f / 64, kRadiusStep = 1.0f / (1 << 20);  // m

void append(std::vector<float>& to, const std::vector<float>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

}  // namespace

void PoseTimes::add(const PoseTimes& other) {
  append(whole, other.whole);
  append(toTick, other.toTick);
  append(tickToPacket, other.tickToPacket);
  append(packetToDecoded, other.packetToDecoded);
  append(decodedToDisplayable, other.decodedToDisplayable);
}

float PoseTiming::nextRadius(std::uint64_t nowUs) {
  const std::uint64_t number = set_++ % kNumbers;
  setUs_[number] = nowUs;
  return kLeastRadius + static_cast<float>(number) * kRadiusStep;
}

void PoseTiming::shown(float radius, const FrameTimes& frame, PoseTimes& out) {
  const float number = (radius - kLeastRadius) / kRadiusStep;
  if (!(number >= 0 && number < kNumbers) || number != std::floor(number)) return;
  // Number of poses that were set after this one.
  const std::uint64_t newer = (set_ - 1 - static_cast<std::uint64_t>(number)) % kNumbers;
  if (newer >= set_ - shown_) return;
  shown_ = std::max(shown_, set_ - std::min<std::uint64_t>(set_, kNumbers));
  for (; shown_ < set_ - newer; ++shown_) {
    const auto setAt = static_cast<double>(setUs_[shown_ % kNumbers]);
    const auto ms = [](double from, double to) { return static_cast<float>((to - from) / 1000); };
    out.whole.push_back(ms(setAt, frame.displayable));
    out.toTick.push_back(ms(setAt, frame.tick));
    out.tickToPacket.push_back(ms(frame.tick, frame.packet));
    out.packetToDecoded.push_back(ms(frame.packet, frame.decoded));
    out.decodedToDisplayable.push_back(ms(frame.decoded, frame.displayable));
  }
}

}  // namespace clothstream::load
