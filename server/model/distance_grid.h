// SPDX-License-Identifier: MIT
// The grid on which signed distances of a closed mesh are sampled.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "server/model/closed_mesh.h"

namespace clothstream::model {

// Most points of a grid. Each takes 16 bytes on the device.
inline constexpr std::size_t kMaxDistancePoints = 1u << 18;
// Least distance of the grid's sides from the mesh, m. Points outside of the grid get a lower bound of their
// distance, so this is larger than common thicknesses.
inline constexpr float kDistanceMargin = 0.02f;

struct DistanceGrid {
  Vec3 origin;                            // the first point, m
  float cell = 0;                         // distance of neighbouring points, m
  std::array<std::uint32_t, 3> counts{};  // points along x, y and z, at least 2

  std::uint64_t points() const { return std::uint64_t{counts[0]} * counts[1] * counts[2]; }
};

// The grid around the mesh, with two cells and kDistanceMargin on each side. `cell` is above 0. The number of
// points may exceed kMaxDistancePoints.
DistanceGrid distanceGridOf(const ClosedMesh& mesh, float cell);
// Shortest side of the mesh's box, m.
float thinnestSide(const ClosedMesh& mesh);

}  // namespace clothstream::model
