// SPDX-License-Identifier: MIT
// Tables of the coarse levels of a scene.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "shaders/coarse/coarse.h"

namespace clothstream::simulation {

// Two shares in one texel.
struct CoarseSharePair {
  shared::CoarseShare shares[2];
};

struct CoarseTables {
  // A coarse level of a cloth. `push` lacks what changes while the scene runs.
  struct Level {
    shared::CoarsePush push;
    std::size_t cloth;
    std::uint32_t every;  // substeps between two corrections
  };

  std::vector<Level> levels;
  std::vector<shared::CoarseNodeRecord> nodes;
  std::vector<CoarseSharePair> means;
  std::vector<CoarseSharePair> shares;
  std::vector<shared::ListRecord> colours;
  std::vector<shared::CoarseLinkRecord> links;
  std::uint32_t parts = 0;  // partial sums of all means
};

CoarseTables coarseTables(std::span<const model::Cloth> cloths);

}  // namespace clothstream::simulation
