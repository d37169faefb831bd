// SPDX-License-Identifier: MIT
// Input that a participant sends: plain data in scene coordinates.
#pragma once

#include <array>
#include <cstdint>

#include <clothstream/core.h>

#include "clients/xr/input/sample.h"

namespace clothstream::xr {

struct OwnInput {
  bool hasHead = false;
  Pose head;
  float headRadius = 0;  // m
  std::array<bool, kSides> hasHand{};
  // x, y, z and radius of each joint.
  std::array<std::array<float, 4 * hands::kJoints>, kSides> hands{};
  // Spheres of controllers, and the sides that have them.
  std::uint32_t colliderCount = 0;
  std::array<cs_own_collider, kSides> colliders{};
  std::array<Side, kSides> colliderSides{};
  std::uint32_t grabCount = 0;
  std::array<cs_grab, kSides> grabs{};
};

// Sends input, and the absence of what was sent before.
class InputSender {
 public:
  // `atUs` is the time for which the poses hold, on the clock of the client.
  void send(cs_client* client, const OwnInput& input, std::uint64_t atUs);
  // Call when another client follows, which has been sent nothing.
  void forget() { *this = {}; }

 private:
  bool head_ = false, colliders_ = false, grabs_ = false;
  std::array<bool, kSides> hands_{};
};

}  // namespace clothstream::xr
