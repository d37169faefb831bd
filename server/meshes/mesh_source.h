// SPDX-License-Identifier: MIT
// A mesh as a file or a message gives it, unchecked, and the way from there to a cloth's mesh.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/model/mesh.h"

namespace clothstream::meshes {

struct SourceFace {
  std::uint32_t cornerCount = 3;  // 3 or 4
  // In a circle, counter-clockwise seen from the front.
  std::array<std::uint32_t, 4> vertices = {};
  std::array<std::uint32_t, 4> uvs = {};  // where the source has any
};

// In the numbers of whoever made it.
struct MeshSource {
  std::vector<model::Vec3> vertices;
  std::vector<model::Uv> uvs;  // empty: none, and none in the faces
  std::vector<SourceFace> faces;
  // Triangles that with the face after them are the halves of a quad, ascending.
  std::vector<std::size_t> halves;
  struct Part {
    std::string name;
    std::size_t firstFace = 0;
  };
  std::vector<Part> parts;  // in the order of their faces, the first from face 0; empty: one without name
};

struct MeshLimits {
  std::uint64_t maxVertices = 0;  // also of faces, twice as many
  float maxCoordinate = 0;        // m from the origin, an axis
  float minEdge = 0;              // m
};

struct MeshOptions {
  model::Pose pose = {};
  float scale = 1;         // of the source's units to metres, before the pose
  float weldDistance = 0;  // m; vertices nearer than this become one node; 0: none do
};

struct BuiltMesh {
  model::Mesh mesh;
  // Of each of the source's vertices its node; kNoNode where it has no face.
  std::vector<std::uint32_t> nodeOfVertex;
};
inline constexpr std::uint32_t kNoNode = ~0u;

// Scales and places, welds, orders nodes along a curve through space (so that neighbours on the cloth are
// neighbours in memory; what is in that order already stays in it), halves quads along their shorter
// diagonal, and checks all that MeshShape asks for. Vertices that no face uses are left out. An error names
// what is wrong by the source's numbers, counted from 0, and says what to do about it.
[[nodiscard]] tl::expected<BuiltMesh, std::string> buildMesh(const MeshSource& source,
                                                             const MeshOptions& options,
                                                             const MeshLimits& limits);

}  // namespace clothstream::meshes
