// SPDX-License-Identifier: MIT
// Reads mesh files: Wavefront OBJ and glTF 2.0.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// Parses text in the OBJ format. Faces keep any number of corners. A new part starts where object, group
// or material changes. Its name is that of the material, or else of the object. Material files are not read.
[[nodiscard]] tl::expected<MeshSource, std::string> parseObj(std::string_view text);

struct FileLimits {
  std::uint64_t bytes = 0;
  std::uint64_t vertices = 0;  // of all instances in a glTF scene; buildMesh() checks those of OBJ
};

// Reads an .obj, .gltf or .glb file. The result of a glTF file contains the triangles of all meshes in its
// scene, transformed by its nodes. Primitives may be compressed with Draco. Each primitive is a part with the
// name of its material, or else of its mesh. Texture coordinates are TEXCOORD_0. The error starts with the
// path.
[[nodiscard]] tl::expected<MeshSource, std::string> readMeshFile(const std::filesystem::path& path,
                                                                 const FileLimits& limits);

}  // namespace clothstream::meshes
