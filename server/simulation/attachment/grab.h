// SPDX-License-Identifier: MIT
// Grabs on cloth as a tick sees them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "server/model/pose.h"

namespace clothstream::simulation {

// Point of a cloth: the mean of three nodes of the scene with these weights, which add up to 1.
struct WeightedNodes {
  std::array<std::uint32_t, 3> nodes = {};
  std::array<float, 3> weights = {};
  bool operator==(const WeightedNodes&) const = default;
};

// A grab moves from start to end over the tick's substeps, as a MovingCollider does. Metres and newtons; the
// parameters are those of model::Grab.
struct Grab {
  enum class State : std::uint8_t {
    free,  // releases all of its nodes
    holds,
    takes,  // grabs nodes near its start, or near its place
  };
  State state = State::free;
  model::Pose start = {}, end = {};
  float radius = 0.03f, reach = 0.1f;  // m, of a beginning grab
  float maxForce = 20;
  float slipDistance = 0.1f;
  // Place that a beginning grab takes, wherever it is. Its distance from the grab's start then shrinks.
  std::optional<WeightedNodes> place = {};
  // Part of that distance which is left at the tick's start and end, 1 to 0. Nothing slips while it is not 0
  // at the end.
  float leftAtStart = 0, leftAtEnd = 0;
};

// Largest number of grabs in a tick.
inline constexpr std::size_t kMaxGrabs = 1024;

// Status of a grab after a tick.
struct GrabStatus {
  std::uint32_t taken = 0;    // nodes that it grabbed
  std::uint32_t slipped = 0;  // grabbed nodes that slipped away since
  // From the grab's start to its place when it began, m; 0 for a grab without a place.
  model::Vec3 offset = model::Vec3::Zero();
  bool operator==(const GrabStatus&) const = default;
};

}  // namespace clothstream::simulation
