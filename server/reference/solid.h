// SPDX-License-Identifier: MIT
// Distance from a closed triangle mesh, and the crossing of its surface, in double precision. Both test every
// triangle.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "server/model/closed_mesh.h"

namespace clothstream::reference {

// The point of a mesh that is nearest to a point.
struct NearestPoint {
  double distance = 0;  // m, negative inside
  Eigen::Vector3d point, normal;
};

// Whether the point is inside follows from the solid angle of the mesh: van Oosterom and Strackee, "The solid
// angle of a plane triangle", 1983. The normal is the direction from the nearest point, or that of the
// surface if the point is within 0.1 mm.
NearestPoint nearestOn(const model::ClosedMesh& mesh, const Eigen::Vector3d& p);

struct Crossing {
  double part = 0;  // share of the way
  Eigen::Vector3d normal;
};
// Where the way first crosses the surface from outside.
std::optional<Crossing> firstCrossing(const model::ClosedMesh& mesh, const Eigen::Vector3d& from,
                                      const Eigen::Vector3d& to);

}  // namespace clothstream::reference
