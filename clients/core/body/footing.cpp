// SPDX-License-Identifier: MIT
#include "clients/core/body/footing.h"

#include <cmath>

namespace clothstream::client::body {
namespace {

// Angle from -pi to pi.
double wrapped(double angle) {
  return std::atan2(std::sin(angle), std::cos(angle));
}

// Above 1 if a foot should step.
double strain(const Foothold& foot, const Foothold& home) {
  return length(horizontal(foot.ankle - home.ankle)) / Footing::kFar +
         std::abs(wrapped(foot.heading - home.heading)) / Footing::kTurned;
}

}  // namespace

const std::array<Foothold, 2>& Footing::update(const std::array<Foothold, 2>& homes, double seconds) {
  if (!stands_) {
    stands_ = true;
    feet_ = {Foot{homes[0], {}}, Foot{homes[1], {}}};
    now_ = homes;
    return now_;
  }
  for (std::size_t side = 0; side < 2; ++side) {
    Foot& foot = feet_[side];
    if (!foot.stepped) {
      now_[side].ankle.y = homes[side].ankle.y;  // the floor may move
      continue;
    }
    *foot.stepped += seconds;
    const double t = *foot.stepped / kStepSeconds;
    if (t >= 1) {
      now_[side] = homes[side];
      foot.stepped.reset();
      continue;
    }
    const double part = t * t * (3 - 2 * t);
    now_[side].ankle = foot.from.ankle + part * (homes[side].ankle - foot.from.ankle);
    now_[side].ankle.y = homes[side].ankle.y + kStepHeight * 4 * part * (1 - part);
    now_[side].heading = foot.from.heading + part * wrapped(homes[side].heading - foot.from.heading);
  }
  if (feet_[0].stepped || feet_[1].stepped) return now_;
  const double strains[] = {strain(now_[0], homes[0]), strain(now_[1], homes[1])};
  const std::size_t worse = strains[1] > strains[0] ? 1 : 0;
  if (strains[worse] > 1) feet_[worse] = {now_[worse], 0.0};
  return now_;
}

}  // namespace clothstream::client::body
