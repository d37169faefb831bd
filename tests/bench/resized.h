// SPDX-License-Identifier: MIT
// Cloths of other sizes than their scene has.
#pragma once

#include <cstdint>

#include "server/model/scene.h"

namespace clothstream::bench {

// Changes the cloth, a grid, to size x size nodes, held at the same places, with collision balls in
// proportion to its meshes.
void resize(model::Cloth& cloth, std::uint32_t size);

// Raises the substeps of the scene to the number that its cloths need. Throws std::runtime_error if no number
// is enough.
void raiseSubsteps(model::Scene& scene);

}  // namespace clothstream::bench
