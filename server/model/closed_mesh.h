// SPDX-License-Identifier: MIT
// Solid bodies as closed triangle meshes, made from vertices and triangles and checked.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "server/model/pose.h"
#include "server/model/skin.h"

namespace clothstream::model {

// Largest number of triangles of a closed mesh.
inline constexpr std::size_t kMaxClosedMeshTriangles = 20'000;
// Smallest area of a triangle, m^2. The products in the kernels stay far above the smallest floats.
inline constexpr double kMinTriangleArea = 1e-9;

using TriangleCorners = std::array<std::uint32_t, 3>;

// Surface of a solid. Each edge has exactly two triangles, which traverse it in opposite directions. The
// solid need not be convex or connected.
struct ClosedMesh {
  std::vector<Vec3> vertices;              // m; each has a triangle
  std::vector<TriangleCorners> triangles;  // counter-clockwise seen from outside
  // The triangles across the edges from corner 0 to 1, 1 to 2 and 2 to 0 of each triangle.
  std::vector<TriangleCorners> neighbours;
  // Index of each vertex among those that the mesh was made of.
  std::vector<std::uint32_t> sources;
  float reach = 0;           // m, of a sphere around the origin that contains the mesh
  std::optional<Skin> skin;  // absent: the mesh is rigid
  // Distance of the points at which signed distances are sampled, m; contact is with the distances between
  // them (distance_grid.h). 0: contact is with the triangles. A mesh with a skin has none.
  float distanceCell = 0;
  // How many triangles lie in one place, at rest: of the boxes around them, those that contain a vertex or
  // the middle of a box. Root mean square over at most 256 of each. A search of the nearest point visits them
  // all.
  double crowding = 0;
};

struct ClosedMeshProblem {
  std::optional<std::size_t> triangle;  // absent: the problem concerns the whole mesh
  std::string text;
};

// Vertices must be finite. Vertices in the same place become one, and the order of the others stays. Returns
// a problem if a triangle has an unknown corner or no area, or if there are more than
// kMaxClosedMeshTriangles. Returns a problem also if the surface is not closed, not oriented or inside out.
// Takes time in proportion to the number of triangles, apart from sorting.
std::variant<ClosedMesh, ClosedMeshProblem> makeClosedMesh(std::vector<Vec3> vertices,
                                                           std::vector<TriangleCorners> triangles);

// Arc cosine with an error below 7e-5: Abramowitz and Stegun, "Handbook of Mathematical Functions", 4.4.45.
// It gives the same bits on every machine, unlike the C library's.
double arcCosine(double x);

// Normals at the vertices that tell inside from outside: the sum of the unit normals of the triangles around
// a vertex, each weighted by its angle there. Baerentzen and Aanaes, "Signed distance computation using the
// angle weighted pseudonormal", 2005. Not normalised.
std::vector<Eigen::Vector3d> vertexPseudonormals(std::span<const Vec3> vertices,
                                                 std::span<const TriangleCorners> triangles);

// Merges vertices in the same place. The first of them stays. Vertices without a triangle are removed.
// Corners must exist. Returns the index that each of the others had.
std::vector<std::uint32_t> weld(std::vector<Vec3>& vertices, std::vector<TriangleCorners>& triangles);

// Half of the cross product of two edges: its length is the area of the triangle, m^2.
Eigen::Vector3d areaVector(std::span<const Vec3> vertices, const TriangleCorners& triangle);

// ClosedMesh::crowding, over at most `samples` vertices and as many boxes.
double triangleCrowding(std::span<const Vec3> vertices, std::span<const TriangleCorners> triangles,
                        std::size_t samples);

}  // namespace clothstream::model
