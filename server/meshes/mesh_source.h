// SPDX-License-Identifier: MIT
// Unchecked mesh from a file or message, and its conversion to the mesh of a cloth.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/model/mesh.h"

namespace clothstream::meshes {

struct SourceFace {
  std::uint32_t cornerCount = 3;  // 3 or 4
  // In order around the face, counter-clockwise seen from the front.
  std::array<std::uint32_t, 4> vertices = {};
  std::array<std::uint32_t, 4> uvs = {};  // used if the source has texture coordinates
};

// Mesh with the numbering of its source.
struct MeshSource {
  std::vector<model::Vec3> vertices;
  std::vector<model::Uv> uvs;  // empty: neither the source nor its faces have any
  std::vector<SourceFace> faces;
  // Indices of triangles that form a quad with the next face, ascending.
  std::vector<std::size_t> halves;
  struct Part {
    std::string name;
    std::size_t firstFace = 0;
  };
  std::vector<Part>
      parts;  // in the order of their faces, the first starts at face 0; empty: one part without name
};

struct MeshLimits {
  std::uint64_t maxVertices = 0;  // the limit of faces is twice as many
  float maxCoordinate = 0;        // m, on each axis
  float minEdge = 0;              // m
  std::uint32_t maxNodeSprings = 0;
  model::Cancellation cancellation = {};
};

struct MeshOptions {
  model::Pose pose = {};
  float scale = 1;         // metres per unit of the source; applied before the pose
  float weldDistance = 0;  // m; vertices closer than this become one node; 0: none
};

struct BuiltMesh {
  model::Mesh mesh;
  // Node of each vertex of the source; kNoNode if it has no face.
  std::vector<std::uint32_t> nodeOfVertex;
};
inline constexpr std::uint32_t kNoNode = ~0u;

// Scales, places and welds the vertices, splits quads along their shorter diagonal, and checks the
// requirements of MeshShape. Nodes are ordered along a space-filling curve, so that neighbours on the cloth
// are neighbours in memory. A mesh that is already in this order keeps it. Vertices without a face are left
// out. Errors use the indices of the source, counted from 0, and say what to do. Throws model::Cancelled.
[[nodiscard]] tl::expected<BuiltMesh, std::string> buildMesh(const MeshSource& source,
                                                             const MeshOptions& options,
                                                             const MeshLimits& limits);

}  // namespace clothstream::meshes
