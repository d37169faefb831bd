// SPDX-License-Identifier: MIT
// Scale, pose and limits of the positions of a mesh.
#pragma once

#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// Largest extent of a mesh that MeshOptions::fit has scaled, in metres.
inline constexpr double kFittedSize = 2;

// Scales and places the vertices. A mesh does not fit the world if a coordinate is farther from the origin
// than MeshLimits::maxCoordinate, or if its edges are shorter than MeshLimits::minEdge in the mean. With
// MeshOptions::fit, the middle of such a mesh becomes the origin of its pose; if it is also too fine, or
// larger than half of the world, it becomes kFittedSize large along its longest axis. Otherwise it is
// refused. Indices of faces must exist. Adds to `repairs`.
[[nodiscard]] tl::expected<std::vector<model::Vec3>, std::string> place(const MeshSource& source,
                                                                        const MeshOptions& options,
                                                                        const MeshLimits& limits,
                                                                        Repairs& repairs);

// "(1, 2, 3)"
std::string shownPoint(const model::Vec3& p);

}  // namespace clothstream::meshes
