// SPDX-License-Identifier: MIT
// Joints of the vertices of a glTF file.
#pragma once

#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

#include "server/meshes/gltf_primitive.h"
#include "server/meshes/gltf_skeleton.h"
#include "server/model/skin.h"

namespace clothstream::meshes {

// Joints and weights of the vertices of a primitive, which `read` has, with that binding: the four joints
// with the largest weights. Weights are scaled so that the sum of each vertex is 1.
[[nodiscard]] tl::expected<std::vector<model::VertexJoints>, std::string> readVertexJoints(
    const tinygltf::Model& model, const tinygltf::Primitive& primitive, const GltfPrimitive& read,
    const SkinBinding& binding);

}  // namespace clothstream::meshes
