// SPDX-License-Identifier: MIT
// Nodes, edges and triangles of the cloths that nothing passes through, and a tree of boxes over the
// triangles.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "shaders/motion_bound/motion_bound.h"

namespace clothstream::simulation {

struct MotionBoundTables {
  std::vector<shared::PartRecord> parts;  // nodes, then edges, each once
  std::uint32_t nodeCount = 0;            // of the parts
  std::vector<shared::FaceRecord> faces;
  // Inner boxes by level. The children of a level are leaves or in the levels before it.
  std::vector<shared::BranchRecord> branches;
  std::vector<std::uint32_t> levels;  // first branch of each level, then the number of branches
  std::uint32_t boxCount = 0;

  std::uint32_t edgeCount() const { return static_cast<std::uint32_t>(parts.size()) - nodeCount; }
};

// Tables of the cloths with model::boundsMotion(). The tree divides triangles at the medians of their middles
// at rest.
MotionBoundTables motionBoundTables(std::span<const model::Cloth> cloths);

}  // namespace clothstream::simulation
