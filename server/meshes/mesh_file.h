// SPDX-License-Identifier: MIT
// Reads mesh files: Wavefront OBJ and glTF 2.0.
#pragma once

#include <cstddef>
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

// Asks for the joints of a glTF file.
struct JointRequest {
  std::string animation;                        // name; empty: the first one, or none if the file has none
  std::size_t joints = 0, keys = 0, poses = 0;  // limits; `poses` is that of the keys times the joints
  bool animated = true;                         // false: no animation is read, and the skin has no keys
  bool attributes = false;                      // true: MeshSource::attributes is read
};

// Reads an .obj, .gltf or .glb file. The result of a glTF file contains the triangles of all meshes in its
// scene, transformed by its nodes. Primitives may be compressed with Draco. Each primitive is a part with the
// name of its material, or else of its mesh. Texture coordinates are TEXCOORD_0.
//
// With `joints`, the vertices of a file with skins are where the skins bind them, and the result has one skin
// with the joints of all. All meshes of the scene must have a skin then. A file without a skin is read as
// usual, and refused if an animation is named. Without `joints`, the vertices of a mesh with a skin are where
// its joints place them in the poses of their nodes, and the result has no skin.
//
// The error starts with the path.
[[nodiscard]] tl::expected<MeshSource, std::string> readMeshFile(const std::filesystem::path& path,
                                                                 const FileLimits& limits,
                                                                 const JointRequest* joints = nullptr);

}  // namespace clothstream::meshes
