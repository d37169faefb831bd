// SPDX-License-Identifier: MIT
// Distances along a cloth between its nodes and its fixed nodes. [KCM12] Kim, Chentanez and Mueller-Fischer,
// "Long Range Attachments - A Method to Simulate Inextensible Clothing", SCA 2012.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

struct Tether {
  static constexpr std::uint32_t kNone = ~0u;
  std::uint32_t anchor = kNone;  // pinned or attached node of the cloth
  float length = 0;  // m along structural and shear springs at rest: at least the geodesic distance
};

// Tethers of a node, the shorter first: to the nearest anchor, and to the nearest anchor of another group.
// Anchors connected by springs form a group.
using NodeTethers = std::array<Tether, 2>;

// Tethers of each node, without slack. Anchors, and nodes that no springs connect to an anchor, have none.
std::vector<NodeTethers> nodeTethers(const Cloth& cloth);

}  // namespace clothstream::model
