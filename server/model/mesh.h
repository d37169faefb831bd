// SPDX-License-Identifier: MIT
// A cloth of any triangles: its rest shape, and what follows from it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "server/model/springs.h"

namespace clothstream::model {

using Triangle = std::array<std::uint32_t, 3>;
using Uv = Eigen::Vector2f;

// Triangles in a row that are drawn with one material.
struct Submesh {
  std::string name;  // for people; may be empty
  std::uint32_t firstTriangle = 0, triangleCount = 0;
};

// Every edge has one or two triangles, which run through it in opposite directions; every node has a
// triangle; no edge is shorter than 0.1 mm.
struct MeshShape {
  std::vector<Vec3> positions;      // of the nodes at rest, in world space
  std::vector<Triangle> triangles;  // nodes, counter-clockwise seen from the front
  // Of each quad the number t of its first triangle, ascending: t and t + 1 are its halves, and the edge that
  // they share is its diagonal.
  std::vector<std::uint32_t> quads;
  // Texture coordinates, and the three of each triangle; both empty where there are none.
  std::vector<Uv> uvs;
  std::vector<Triangle> uvTriangles;
  // Together all triangles, in order.
  std::vector<Submesh> submeshes;
};

// Immutable once made; cloths share it.
struct Mesh {
  MeshShape shape;
  std::vector<double> areas;      // m^2 a node: a third of each of its triangles
  std::vector<double> shares;     // of the cloth's mass a node, in proportion to its area
  std::vector<SpringLink> links;  // ordered as springLinks() says

  std::uint32_t nodeCount() const { return static_cast<std::uint32_t>(shape.positions.size()); }
  double area() const;  // m^2
};

// Springs: structural along the edges of triangles and quads, shear along both diagonals of a quad, bend
// across an edge of two faces. Across it, a triangle ends in its third corner, a quad at each of the edge's
// ends in that corner's other neighbour: a grid's quads get the springs of a grid. Of two nodes that several
// springs would join, the first in that order does.
Mesh makeMesh(MeshShape shape);

// Of any cloth, in the order in which forces and normals take them. A grid's quad with corners a b above e f
// is (a, e, b), (b, e, f).
std::vector<Triangle> clothTriangles(const Cloth& cloth);

}  // namespace clothstream::model
