// SPDX-License-Identifier: MIT
// Dihedral bending: resistance of a cloth against rotation of neighbouring faces around their shared edge.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

// Maximum number of nodes of all cloths with dihedral bending in a scene.
inline constexpr std::uint32_t kMaxBendingNodes = 1'048'576;

// Edge from a to b between the triangles (a, b, c) and (b, a, d), which are faces or halves of quads.
struct Hinge {
  std::array<std::uint32_t, 4> nodes;  // a, b, c, d
  float weight;                        // squared edge length over the area of both triangles, at rest
  float restAngle;                     // rad, -pi to pi; positive if the front is concave
  float leastSquare;  // m^4, minimum squared length of a triangle's area normal; smaller ones count as this
                      // large
};

// The angle theta of a hinge, positive if the front is concave. sine and cosine are less than those of theta
// if a triangle is compressed.
struct HingeShape {
  double sine, cosine;
  std::array<Eigen::Vector3d, 4> gradients;  // gradients of theta, 1/m
};
HingeShape hingeShape(const std::array<Eigen::Vector3d, 4>& positions, double leastSquare);

// 2 sin(delta / 2), where delta, from -pi to pi, is how far the angle is from that at rest. A hinge acts on
// node i with the force -B weight 2 sin(delta / 2) grad_i theta: [BMF03] Bridson, Marino, Fedkiw, "Simulation
// of Clothing with Folds and Wrinkles", SCA 2003, 3, for rest angles other than zero, too. The energy, B
// weight 4 (1 - cos(delta / 2)), has its only minimum at rest and no jump: a hinge may be folded at rest and
// pass 180 degrees. A sheet of equilateral triangles bent to a cylinder has the energy of a plate with
// flexural rigidity B (N m): B / 2 times squared curvature times area.
double bentFromRest(const HingeShape& shape, double restAngle);

// Hinges of every edge between two faces. An edge of a quad has one hinge of half weight for each way to
// split the quad. The two diagonals of a quad together have an eighth of the weight. A sheet of squares then
// resists bending along its diagonals within 12 % of bending along its rows, however triangles split the
// squares.
std::vector<Hinge> hinges(const Cloth& cloth);

// Upper bound of the squared rate of any bending mode around the rest shape, for a flexural rigidity of 1 N
// m, 1/s^2.
double bendingRate(const Cloth& cloth);

}  // namespace clothstream::model
