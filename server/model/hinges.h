// SPDX-License-Identifier: MIT
// Dihedral bending: what it takes to turn a cloth's faces against each other across their edges.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

// An edge from a to b of two triangles, (a, b, c) and (b, a, d), which are faces or halves of quads.
struct Hinge {
  std::array<std::uint32_t, 4> nodes;  // a, b, c, d
  float weight;                        // square of the edge's length over the area of both triangles, at rest
  float bent;                          // of HingeShape, at rest
  float leastSquare;  // m^4, of a normal: triangles that are squeezed below this part of their area at rest
                      // bend like those
};

// [BMF03] Bridson, Marino, Fedkiw, "Simulation of Clothing with Folds and Wrinkles", SCA 2003, 3: a hinge
// turned by theta pulls at node i with -B weight (2 sin(theta / 2) - bent) grad_i theta. With this weight the
// energy of a sheet of equilateral triangles that is bent to a cylinder is that of a plate of flexural
// rigidity B (N m): B / 2 times the square of the curvature times the area.
struct HingeShape {
  double bent;                               // 2 sin(theta / 2); above 0 where the front is hollow
  std::array<Eigen::Vector3d, 4> gradients;  // of theta, 1/m
};
HingeShape hingeShape(const std::array<Eigen::Vector3d, 4>& positions, double leastSquare);

// Of every edge between two faces; where one is a quad, half for each way of cutting it, and its two
// diagonals an eighth together, so that a sheet of squares resists along its diagonals as along its rows but
// for 12 %, whichever way triangles cut the squares.
std::vector<Hinge> hinges(const Cloth& cloth);

// The largest square of a mode's rate for a flexural rigidity of 1 N m about the shape at rest, at most,
// 1/s^2.
double bendingRate(const Cloth& cloth);

}  // namespace clothstream::model
