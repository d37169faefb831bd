// SPDX-License-Identifier: MIT
// Meshes between messages and the domain.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/scene.pb.h"
#include "server/meshes/mesh_source.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Gives the mesh that a scene names as its file; the error says which file, and what is wrong with it.
using MeshReader = std::function<tl::expected<meshes::MeshSource, std::string>(const std::string& file)>;

// Sets the cloth's mesh; returns the node that each vertex of the message became, or meshes::kNoNode. Without
// a reader no file may be named.
std::vector<std::uint32_t> toMeshCloth(Checks& checks, const Path& path, const v1::Cloth& message,
                                       const MeshReader& readMesh, model::Cloth& cloth);

// The mesh itself, whatever file it came from: in the scene's frame, welded, in the order of its nodes.
void write(const model::Mesh& mesh, v1::Mesh& message);

}  // namespace clothstream::messages
