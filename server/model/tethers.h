// SPDX-License-Identifier: MIT
// How far along a cloth its nodes are from those that no force moves: [KCM12] Kim, Chentanez and
// Mueller-Fischer, "Long Range Attachments - A Method to Simulate Inextensible Clothing", SCA 2012.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

struct Tether {
  static constexpr std::uint32_t kNone = ~0u;
  std::uint32_t anchor = kNone;  // a node of the cloth that no force moves
  float length = 0;  // m along structural and shear springs at rest: at least the geodesic distance
};

// A node's tethers, the shorter first: to the nearest anchor, and to the nearest of another group of anchors;
// anchors with a spring between them are a group.
using NodeTethers = std::array<Tether, 2>;

// One a node; none for anchors, and for nodes from which no spring leads to one. Slack apart.
std::vector<NodeTethers> nodeTethers(const Cloth& cloth);

}  // namespace clothstream::model
