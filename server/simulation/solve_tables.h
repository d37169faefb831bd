// SPDX-License-Identifier: MIT
// The linear systems of a scene as the kernels read them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// Systems that the same kernels solve, one after the other in the tables: first those that one workgroup
// solves each, then the large ones.
struct SolveGroup {
  model::SolverKind kind = model::SolverKind::constraint;
  bool mesh = false;
  bool bend = false;  // some grid has bend springs in its system
  std::uint32_t firstSystem = 0, smallSystems = 0;
  std::uint32_t firstChunk = 0, firstLargeChunk = 0, endChunk = 0;
  std::uint32_t firstSpring = 0, endSpring = 0;  // of meshes
  std::uint32_t iterations = 0;                  // the most of any
  std::uint32_t smallChunks = 0;                 // of the largest of the small ones

  bool hasLarge() const { return firstLargeChunk < endChunk; }
};

struct SolveTables {
  std::vector<SolveGroup> groups;  // those that there are
  std::vector<shared::SystemRecord> systems;
  std::vector<shared::ChunkRecord> chunks;
  std::vector<shared::LinkRecord> springs;          // of meshes, in the order of model::springLinks()
  std::vector<shared::IncidenceRecord> incidences;  // a node of the scene
  std::vector<shared::SpringEndsRecord> lists;
  std::uint32_t nodes = 0;   // of the scene
  std::uint32_t listed = 0;  // texels of the longest list
};

// `wholeNodes`: of the largest cloth that one workgroup solves. Cloths whose systems are assembled are left
// out (AssembledStage); of meshes, springs between two pinned nodes, where nothing can move.
SolveTables solveTables(std::span<const model::Cloth> cloths, std::uint32_t wholeNodes);

}  // namespace clothstream::simulation
