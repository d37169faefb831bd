// SPDX-License-Identifier: MIT
// Geometry of a primitive of a glTF file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

#include "server/model/mesh.h"

namespace clothstream::meshes {

inline constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";
inline constexpr const char* kMeshoptExtension = "EXT_meshopt_compression";
inline constexpr const char* kQuantizationExtension = "KHR_mesh_quantization";

// Null if a list of a glTF file has no such element.
template <typename List>
auto* elementAt(const List& list, int index) {
  return index >= 0 && static_cast<std::size_t>(index) < list.size() ? &list[static_cast<std::size_t>(index)]
                                                                     : nullptr;
}

// Says what to do with a file that is compressed with meshopt.
std::string meshoptError();

struct GltfPrimitive {
  std::vector<model::Vec3> positions;  // without the transform of a node
  std::vector<model::Uv> uvs;  // TEXCOORD_0, as many as positions, v downwards; empty if there are none
  std::vector<std::uint32_t> indices;  // three per triangle; of any vertices
};

struct PrimitiveLimits {
  std::uint64_t vertices = 0, triangles = 0;
};

// Reads the triangles of a primitive, which may be compressed with Draco. Larger ones are refused before
// anything is allocated for them.
[[nodiscard]] tl::expected<GltfPrimitive, std::string> readPrimitive(const tinygltf::Model& model,
                                                                     const tinygltf::Primitive& primitive,
                                                                     const PrimitiveLimits& limits);

}  // namespace clothstream::meshes
