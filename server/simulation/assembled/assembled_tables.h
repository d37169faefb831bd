// SPDX-License-Identifier: MIT
// Sparse matrices of the constraints' systems of a scene, [Va21] 3.2.2, without their values.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/scene_tables.h"
#include "shaders/assembled/assembled.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// Partition of the work. The results do not depend on it.
struct AssembledCut {
  std::uint32_t workgroup;   // divides CLOTHSTREAM_SOLVE_LANES
  std::uint32_t wholeNodes;  // nodes of the largest cloth that one workgroup solves
  std::uint32_t rounds;      // loop rounds that the device allows an invocation
};

// Tables that the kernels read. Every table follows the order of the systems: first those that one workgroup
// solves, then the others.
struct AssembledTables {
  std::vector<std::uint32_t> cloths;  // of each system
  std::vector<shared::AssembledSystemRecord> systems;
  std::vector<shared::AssembledChunkRecord> chunks;
  // One row of J per spring, in the order of model::systemLinks(). Its two columns are the nodes.
  std::vector<shared::LinkRecord> rows;
  // The system matrix by rows, with ascending columns: where a row lies, its columns, and the blocks of J
  // that make each entry.
  std::vector<shared::EntriesRecord> entries;
  std::vector<shared::NumbersRecord> columns, sources;
  // J by columns (CSC): where the entries of a node of the scene lie, and the entries in ascending order.
  std::vector<shared::EntriesRecord> nodeEntries;
  std::vector<shared::NumbersRecord> nodeRows;
  std::vector<shared::NodeRangeRecord> nodeRanges;        // each node of these cloths once
  TileRange wholeSystems{}, partChunks{};                 // ranges of `systems` and of `chunks`
  std::uint32_t wholeIterations = 0, partIterations = 0;  // the largest of any cloth
  std::uint32_t wholeRounds =
      0;  // loop rounds of an iteration of the largest cloth that one workgroup solves
};

// Tables of the cloths with model::isAssembled(). Springs between two pinned nodes are left out.
AssembledTables assembledTables(std::span<const model::Cloth> cloths, const AssembledCut& cut);

}  // namespace clothstream::simulation
