// SPDX-License-Identifier: MIT
// Distance from a closed triangle mesh, and the crossing of its surface, in double precision. Both test every
// triangle.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include "server/model/closed_mesh.h"

namespace clothstream::reference {

// The point of a mesh that is nearest to a point.
struct NearestPoint {
  double distance = 0;  // m, negative inside
  Eigen::Vector3d point, normal;
  std::size_t triangle = 0;                                  // that has the point
  std::array<double, 3> weights{1.0 / 3, 1.0 / 3, 1.0 / 3};  // of its corners
};

// Whether the point is inside follows from the solid angle of the mesh: van Oosterom and Strackee, "The solid
// angle of a plane triangle", 1983. The normal is the direction from the nearest point, or that of the
// surface if the point is within 0.1 mm.
NearestPoint nearestOn(const model::ClosedMesh& mesh, const Eigen::Vector3d& p);

// The same by trilinear interpolation between the points of the mesh's grid, whose distances are nearestOn()
// each time. Outside of the grid the distance is a lower bound. The triangle means nothing. A mesh without
// `distanceCell` must not be given.
NearestPoint nearestInGrid(const model::ClosedMesh& mesh, const Eigen::Vector3d& p);

struct Crossing {
  double part = 0;  // share of the way
  Eigen::Vector3d normal;
};
// Where the way first crosses the surface from outside.
std::optional<Crossing> firstCrossing(const model::ClosedMesh& mesh, const Eigen::Vector3d& from,
                                      const Eigen::Vector3d& to);

// The mesh that its joints move, at a share of the tick. `start` and `end` are the poses of the joints in the
// frame of the mesh.
model::ClosedMesh moved(const model::ClosedMesh& mesh, std::span<const model::Pose> start,
                        std::span<const model::Pose> end, double progress);

// A mesh between two others with the same triangles.
model::ClosedMesh between(const model::ClosedMesh& from, const model::ClosedMesh& to, double part);

}  // namespace clothstream::reference
