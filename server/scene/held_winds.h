// SPDX-License-Identifier: MIT
// Local winds that participants hold, from tick to tick.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "server/model/input.h"
#include "server/model/scene.h"

namespace clothstream::scene {

// Belongs to the device's thread. The order does not depend on the order of arrival: the participants' by
// their number, each one's as it sent them.
class HeldWinds {
 public:
  struct Placed {
    std::uint64_t participant;
    model::LocalWind wind;
  };

  // Sets all winds of this participant.
  void place(std::uint64_t participant, std::span<const model::HeldWind> winds);
  // Removes all winds.
  void letGo() { placed_.clear(); }
  bool empty() const { return placed_.empty(); }

  // Replaces `winds` by those of the scene, then those that participants hold, at most kMaxLocalWinds. If the
  // speeds of the latter are more than `room` together, m/s, all are slowed by the same factor.
  void advance(const model::Scene& scene, float room, std::vector<model::LocalWind>& winds) const;

  const std::vector<Placed>& state() const { return placed_; }
  // Continues from a state.
  void restore(std::vector<Placed> placed) { placed_ = std::move(placed); }

 private:
  std::vector<Placed> placed_;  // in the order above
};

}  // namespace clothstream::scene
