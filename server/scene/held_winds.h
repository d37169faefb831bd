// SPDX-License-Identifier: MIT
// Local winds that participants hold, from tick to tick.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/input.h"
#include "server/model/scene.h"

namespace clothstream::scene {

// Belongs to the device's thread. The order does not depend on the order of arrival: the participants' by
// their number, each one's as it sent them.
class HeldWinds {
 public:
  // Sets all winds of this participant.
  void place(std::uint64_t participant, std::span<const model::HeldWind> winds);
  // Removes all winds.
  void letGo() { placed_.clear(); }
  bool empty() const { return placed_.empty(); }

  // Replaces `winds` by those of the scene, then those that participants hold, at most kMaxLocalWinds. If the
  // speeds of the latter are more than `room` together, m/s, all are slowed by the same factor.
  void advance(const model::Scene& scene, float room, std::vector<model::LocalWind>& winds) const;

 private:
  struct Placed {
    std::uint64_t participant;
    model::LocalWind wind;
  };
  std::vector<Placed> placed_;
};

}  // namespace clothstream::scene
