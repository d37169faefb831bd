// SPDX-License-Identifier: MIT
// Converts meshes between messages and the model.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/scene.pb.h"
#include "server/meshes/mesh_file.h"
#include "server/meshes/mesh_source.h"
#include "server/messages/scene_limits.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Reads the mesh file that a scene names, with its joints unless `joints` is null. The error names the file
// and the problem.
using MeshReader = std::function<tl::expected<meshes::MeshSource, std::string>(
    const std::string& file, const meshes::JointRequest* joints)>;

// Nodes of the vertices of a mesh.
struct VertexNodes {
  // Node of each vertex of the message or file, or meshes::kNoNode.
  std::vector<std::uint32_t> nodeOfVertex;
  // meshes::BuiltMesh::nextCopy.
  std::vector<std::uint32_t> nextCopy;
};

// Vertices of a cloth, as its message or file has them.
struct ClothVertices {
  VertexNodes nodes;  // empty for a grid
  // Joints and attributes of the vertices of a glTF file, if the cloth has a skin.
  std::optional<model::Skin> skin;
  meshes::VertexAttributes attributes;
};

// Sets the mesh of the cloth. Refuses a file name if there is no reader, and more nodes, or springs of a
// node, than `most`. Adds to `repairs` if something was repaired. Throws model::Cancelled.
ClothVertices toMeshCloth(Checks& checks, const Path& path, const v1::Cloth& message,
                          const MeshReader& readMesh, const SceneLimits& most, model::Cloth& cloth,
                          std::vector<v1::MeshRepair>& repairs);

// Writes the mesh itself, not the name of its file: in world space, welded and repaired, in the order of its
// nodes.
void write(const model::Mesh& mesh, v1::Mesh& message);

}  // namespace clothstream::messages
