// SPDX-License-Identifier: MIT
// Attributes of a glTF file that limit how far the nodes of a cloth leave their skinned places.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <string_view>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

#include "server/meshes/gltf_primitive.h"
#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

inline constexpr const char* kMaxDistance = "_MAX_DISTANCE";
inline constexpr const char* kBackstopDistance = "_BACKSTOP_DISTANCE";
inline constexpr const char* kBackstopRadius = "_BACKSTOP_RADIUS";
inline constexpr const char* kColours = "COLOR_0";
// All of them.
inline constexpr std::array<std::string_view, 4> kSkinAttributes{kMaxDistance, kBackstopDistance,
                                                                 kBackstopRadius, kColours};

// Appends the attributes of a primitive, whose vertices `read` has, to those of the `before` vertices of the
// primitives before it. Attributes have one number for each vertex, and colours three or four.
[[nodiscard]] tl::expected<void, std::string> addAttributes(const tinygltf::Model& model,
                                                            const tinygltf::Primitive& primitive,
                                                            const GltfPrimitive& read, std::size_t before,
                                                            VertexAttributes& attributes);

// Extends the lists that are not empty to `vertices` elements.
void completeAttributes(std::size_t vertices, VertexAttributes& attributes);

}  // namespace clothstream::meshes
