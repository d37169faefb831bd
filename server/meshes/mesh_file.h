// SPDX-License-Identifier: MIT
// Meshes on disk: Wavefront OBJ and glTF 2.0.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// A text in the OBJ format. Faces have three or four corners; a part begins wherever object, group or
// material changes, and has the material's name, else the object's. Materials themselves are not read.
[[nodiscard]] tl::expected<MeshSource, std::string> parseObj(std::string_view text);

// By its ending: .obj, .gltf or .glb, of at most `maxBytes`. Of a glTF the triangles of all meshes in its
// scene, where its nodes put them, a part a primitive, named after its material, else its mesh; the texture
// coordinates are TEXCOORD_0. The error begins with the path.
[[nodiscard]] tl::expected<MeshSource, std::string> readMeshFile(const std::filesystem::path& path,
                                                                 std::uint64_t maxBytes);

}  // namespace clothstream::meshes
