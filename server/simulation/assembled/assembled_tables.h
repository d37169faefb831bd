// SPDX-License-Identifier: MIT
// The constraints' systems of a scene as sparse matrices, [Va21] 3.2.2, but for their values.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/scene_tables.h"
#include "shaders/assembled/assembled.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// How the work is cut; the results do not depend on it.
struct AssembledCut {
  std::uint32_t workgroup;   // divides CLOTHSTREAM_SOLVE_LANES
  std::uint32_t wholeNodes;  // of the largest cloth that one workgroup solves
  std::uint32_t rounds;      // of loops that the device lets an invocation make
};

// What the kernels read. Every table is in the order of the systems: first those that one workgroup solves
// each, then the others.
struct AssembledTables {
  std::vector<std::uint32_t> cloths;  // of each system
  std::vector<shared::AssembledSystemRecord> systems;
  std::vector<shared::AssembledChunkRecord> chunks;
  // A row a spring, in the order of model::systemLinks(): a row of J, whose two columns are the nodes.
  std::vector<shared::LinkRecord> rows;
  // The system matrix by rows, columns in ascending order: where a row lies, its columns, and of which blocks
  // of J its entries are made.
  std::vector<shared::EntriesRecord> entries;
  std::vector<shared::NumbersRecord> columns, sources;
  // J by columns (CSC): where a node of the scene lies, and its entries in ascending order.
  std::vector<shared::EntriesRecord> nodeEntries;
  std::vector<shared::NumbersRecord> nodeRows;
  std::vector<shared::NodeRangeRecord> nodeRanges;        // each node of these cloths once
  TileRange wholeSystems{}, partChunks{};                 // of `systems`; of `chunks`
  std::uint32_t wholeIterations = 0, partIterations = 0;  // the most of any
  std::uint32_t wholeRounds = 0;  // of loops, of one iteration of the largest that one workgroup solves
};

// Of the cloths with model::isAssembled(). Springs between two pinned nodes are left out.
AssembledTables assembledTables(std::span<const model::Cloth> cloths, const AssembledCut& cut);

}  // namespace clothstream::simulation
