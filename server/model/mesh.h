// SPDX-License-Identifier: MIT
// Triangle meshes: rest shape, areas and springs of a cloth that is not a grid.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/model/cancellation.h"
#include "server/model/springs.h"

namespace clothstream::model {

using Triangle = std::array<std::uint32_t, 3>;
using Uv = Eigen::Vector2f;

// Consecutive triangles that are drawn with one material.
struct Submesh {
  std::string name;  // for people; may be empty
  std::uint32_t firstTriangle = 0, triangleCount = 0;
};

// Every edge has one or two triangles, which traverse it in opposite directions. Every node has a triangle.
// No edge is shorter than 0.1 mm.
struct MeshShape {
  std::vector<Vec3> positions;      // rest positions of the nodes in world space
  std::vector<Triangle> triangles;  // nodes, counter-clockwise seen from the front
  // Index t of the first triangle of each quad, ascending. Triangles t and t + 1 are its halves; their shared
  // edge is its diagonal.
  std::vector<std::uint32_t> quads;
  // Texture coordinates, and the indices of the three of each triangle. Both are empty if the mesh has none.
  std::vector<Uv> uvs;
  std::vector<Triangle> uvTriangles;
  // Parts of the mesh. Together they cover all triangles in order.
  std::vector<Submesh> submeshes;
};

// Immutable once made. Copies of a cloth share it.
struct Mesh {
  MeshShape shape;
  std::vector<double> areas;      // m^2 per node: a third of each of its triangles
  double area = 0;                // m^2
  std::vector<double> shares;     // fraction of the cloth's mass per node, proportional to its area
  std::vector<SpringLink> links;  // ordered as springLinks() says
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // box of the positions, m
  // The two nodes of an edge with one triangle; nothing: the surface is closed.
  std::optional<std::array<std::uint32_t, 2>> openEdge;
  // Of a closed surface: parts without a common node, and the volume inside, m^3, negative if its fronts are
  // inside.
  std::uint32_t pieces = 0;
  double volume = 0;

  std::uint32_t nodeCount() const { return static_cast<std::uint32_t>(shape.positions.size()); }
};

// Makes a mesh and its springs. Structural springs follow the edges of triangles and quads. Shear springs
// follow both diagonals of a quad. Bend springs cross an edge between two faces. They join the third corner
// of a triangle, or the two corners of a quad that are not on the edge. The quads of a grid thus get the
// springs of a grid. Two nodes get at most one spring: the first in the order structural, shear, bend.
// Throws Cancelled.
Mesh makeMesh(MeshShape shape, const Cancellation& cancellation = {});

// Triangles of a grid or mesh, in the order in which forces and normals are accumulated. A grid's quad with
// corners a b above e f is (a, e, b), (b, e, f).
std::vector<Triangle> clothTriangles(const Cloth& cloth);
std::uint32_t triangleCount(const Cloth& cloth);
// Triangle `index` of them, less than triangleCount().
Triangle triangleAt(const Cloth& cloth, std::uint32_t index);

}  // namespace clothstream::model
