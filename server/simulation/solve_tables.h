// SPDX-License-Identifier: MIT
// Tables of the linear systems of a scene.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// Systems that the same kernels solve; they are consecutive in the tables. Systems that one workgroup solves
// come first, then the large ones.
struct SolveGroup {
  model::SolverKind kind = model::SolverKind::constraint;
  model::AcadMode acadMode = model::AcadMode::limit;  // for acad
  bool mesh = false;
  bool bend = false;  // a grid has bend springs in its system
  std::uint32_t firstSystem = 0, smallSystems = 0, endSystem = 0;
  std::uint32_t firstChunk = 0, firstLargeChunk = 0, endChunk = 0;
  std::uint32_t firstSpring = 0, endSpring = 0;  // of meshes
  std::uint32_t iterations = 0;                  // of one solve: the largest of any cloth
  std::uint32_t smallChunks = 0;                 // of the largest small system
  // Largest number of loop rounds of an invocation in one iteration of a small system; 0 if they are not
  // limited.
  std::uint32_t smallLoops = 0;
  // One workgroup per system solves for the ends of stretched springs only (StretchedSystems).
  bool stretched = false;
  // Width of the workgroups that continue long solves of such systems; 0 if no solve is too long.
  std::uint32_t continuedWorkgroup = 0;

  bool hasLarge() const { return firstLargeChunk < endChunk; }
};

struct SolveTables {
  std::vector<SolveGroup> groups;  // groups that have systems
  std::vector<shared::SystemRecord> systems;
  std::vector<shared::ChunkRecord> chunks;
  std::vector<shared::LinkRecord> springs;     // of meshes, in the order of model::springLinks()
  std::vector<shared::ListRecord> incidences;  // by node of the scene: its texels of `lists`
  std::vector<shared::SpringEndsRecord> lists;
  std::uint32_t nodes = 0;  // of the scene
};

// Limits of a workgroup that solves for stretched springs only (stretchedLimits()).
struct StretchedLimits {
  std::uint32_t wholeNodes;  // of the largest cloth
  std::uint32_t workgroup, widestWorkgroup;
  std::uint32_t mostLoops;  // rounds of loops of an invocation
};

// WholeLimits::mostLoops of a device without a limit.
inline constexpr std::uint32_t kUnlimitedLoops = ~0u;

// Limits of a workgroup that solves for all springs of a cloth. Results do not depend on them.
struct WholeLimits {
  std::uint32_t nodes;      // of the largest cloth
  std::uint32_t workgroup;  // invocations
  bool spread;              // each node of a walk has its own invocation
  std::uint32_t mostLoops;  // rounds of loops of an invocation, over all loops together
};

// Loop rounds that a dispatch of a small system needs in addition to its iterations, in iterations.
inline constexpr std::uint32_t kSpareIterations = 2;

// A cloth has a small system if it is within `whole` with one iteration per dispatch. Throws
// std::runtime_error, which names the cloth, if so many springs meet at a vertex that not even a chunk is.
// Cloths with assembled systems are left out (AssembledStage). Springs of meshes between two pinned nodes are
// left out.
SolveTables solveTables(std::span<const model::Cloth> cloths, const WholeLimits& whole,
                        const StretchedLimits& stretched);

// Rounds of a group's solve.
std::uint32_t roundsOf(const SolveGroup& group);

}  // namespace clothstream::simulation
