// SPDX-License-Identifier: MIT
// Unchecked mesh from a file or message, and its conversion to the mesh of a cloth.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/meshes/repairs.h"
#include "server/model/mesh.h"
#include "server/model/skin.h"

namespace clothstream::meshes {

struct SourceFace {
  std::uint32_t cornerCount = 3;
  // Corners of a triangle or quad, in order around the face, counter-clockwise seen from the front. A face
  // with any other number of corners has them in MeshSource::corners, from index `vertices[0]` on.
  std::array<std::uint32_t, 4> vertices = {};
  std::array<std::uint32_t, 4> uvs = {};  // used if the source has texture coordinates

  bool isInline() const { return cornerCount == 3 || cornerCount == 4; }
};

struct SourceCorner {
  std::uint32_t vertex = 0, uv = 0;
};

// Numbers that a glTF file gives its vertices for a cloth that follows joints. Each list has an element for
// each vertex, or none if no primitive has the attribute. They are not checked.
struct VertexAttributes {
  static constexpr float kAbsent = -1;  // for vertices of a primitive without the attribute

  std::vector<float> maxDistances, backstopDistances, backstopRadii;  // m
  std::vector<Eigen::Vector4f> colours;                               // red, green, blue, alpha
};

// Mesh with the numbering of its source.
struct MeshSource {
  std::vector<model::Vec3> vertices;
  std::vector<model::Uv> uvs;  // empty: neither the source nor its faces have any
  std::vector<SourceFace> faces;
  std::vector<SourceCorner> corners;  // of faces that are neither triangles nor quads
  // Indices of triangles that form a quad with the next face, ascending.
  std::vector<std::size_t> halves;
  struct Part {
    std::string name;
    std::size_t firstFace = 0;
  };
  std::vector<Part>
      parts;  // in the order of their faces, the first starts at face 0; empty: one part without name
  std::optional<model::Skin> skin;  // joints of the vertices of a glTF file, if they were requested
  VertexAttributes attributes;      // likewise

  // Corner of a face, less than its cornerCount.
  SourceCorner cornerOf(const SourceFace& face, std::uint32_t corner) const {
    return face.isInline() ? SourceCorner{face.vertices[corner], face.uvs[corner]}
                           : corners[face.vertices[0] + corner];
  }
};

struct MeshLimits {
  std::uint64_t maxVertices = 0;  // the limit of faces is twice as many
  float maxCoordinate = 0;        // m, on each axis
  float minEdge = 0;              // m
  std::uint32_t maxNodeSprings = 0;
  model::Cancellation cancellation = {};
};

// Why a mesh is refused, and what to do.
struct MeshError {
  // NOLINTNEXTLINE(google-explicit-constructor): most errors are no more than a text
  MeshError(std::string error, bool beyondALimit = false)
      : text(std::move(error)), isTooLarge(beyondALimit) {}

  std::string text;
  bool isTooLarge;  // it exceeds maxVertices or maxNodeSprings
};

struct MeshOptions {
  model::Pose pose = {};
  float scale = 1;         // metres per unit of the source; applied before the pose
  float weldDistance = 0;  // m; vertices closer than this become one node; 0: none
  bool repair = false;     // repairs what repair.h lists, instead of refusing it
  bool fit = false;        // a mesh that is too large, too small or too far away becomes kFittedSize large
};

struct BuiltMesh {
  model::Mesh mesh;
  // Node of each vertex of the source; kNoNode if it has no face.
  std::vector<std::uint32_t> nodeOfVertex;
  // For each node, another node that the repair made from the same vertices, or kNoNode. Empty: there are
  // none.
  std::vector<std::uint32_t> nextCopy;
  Repairs repairs;
};
inline constexpr std::uint32_t kNoNode = ~0u;

// Scales, places and welds the vertices, repairs the faces if the options say so, splits quads along their
// shorter diagonal, and checks the requirements of MeshShape. Nodes are ordered along a space-filling curve,
// so that neighbours on the cloth are neighbours in memory. A mesh that is already in this order keeps it.
// Vertices without a face are left out. The same source and options give the same mesh. Errors use the
// indices of the source, counted from 0, and say what to do, and whether `repair` or `fit` would help. Takes
// time in proportion to n log n, and memory in proportion to n, for n vertices and corners of faces. Throws
// model::Cancelled.
[[nodiscard]] tl::expected<BuiltMesh, MeshError> buildMesh(const MeshSource& source,
                                                           const MeshOptions& options,
                                                           const MeshLimits& limits);

}  // namespace clothstream::meshes
