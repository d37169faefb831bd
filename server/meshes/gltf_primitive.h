// SPDX-License-Identifier: MIT
// Geometry of a primitive of a glTF file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
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
  // JOINTS_n, WEIGHTS_n and requested attributes that are compressed, by their names. Others stay in their
  // accessors. Those with fewer than four numbers have 0 for the others.
  std::map<std::string, std::vector<Eigen::Vector4f>> vectors = {};
};

struct PrimitiveLimits {
  std::uint64_t vertices = 0, triangles = 0;
};

// Reads the triangles of a primitive, which may be a strip or a fan, or compressed with Draco. Larger ones
// are refused before anything is allocated for them. `attributes` are those to decode if they are compressed.
[[nodiscard]] tl::expected<GltfPrimitive, std::string> readPrimitive(
    const tinygltf::Model& model, const tinygltf::Primitive& primitive, const PrimitiveLimits& limits,
    std::span<const std::string_view> attributes = {});

// Adds the morph targets of the primitive to its positions, each times its weight. Targets without a weight,
// or with the weight 0, change nothing.
[[nodiscard]] tl::expected<void, std::string> addTargets(const tinygltf::Model& model,
                                                         const tinygltf::Primitive& primitive,
                                                         std::span<const double> weights,
                                                         std::span<model::Vec3> positions);

}  // namespace clothstream::meshes
