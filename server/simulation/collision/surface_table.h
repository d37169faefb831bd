// SPDX-License-Identifier: MIT
// Surfaces of the real room as the kernels read them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "server/model/pose.h"
#include "server/model/surface.h"
#include "shaders/shared/types.h"

namespace clothstream::simulation {

// A surface with its tree. Never changes, so that threads may share it.
struct SurfaceTable {
  model::Surface surface;
  // Triangles in the order of the leaves, then vertices, then boxes, as solid.h has them. The SolidRecord
  // that belongs before them depends on their place on the device (recordOf()).
  std::vector<shared::vec4> texels;
  std::uint32_t leafCount = 1;
};
using SharedSurface = std::shared_ptr<const SurfaceTable>;

// Takes time in proportion to the triangles and their logarithm, about 1 us for each: not for the device's
// thread.
SharedSurface makeSurfaceTable(model::Surface surface);

// Texels that a table needs on the device, its SolidRecord included.
std::size_t surfaceTexels(const SurfaceTable& table);
// The SolidRecord of a table whose texels, this record first, begin at `first`: two texels.
std::vector<shared::vec4> surfaceHeader(const SurfaceTable& table, std::size_t first);

// Texels of all surfaces of a scene. A surface and the one that replaces it are both there for some ticks.
std::size_t mostSurfaceTexels();

// A surface that stands in a scene during a tick.
struct PlacedSurface {
  SharedSurface table;
  model::Pose pose = {};
  bool twoSided = false;
  float friction = 1;  // Coulomb; multiplied with the cloth's
};

}  // namespace clothstream::simulation
