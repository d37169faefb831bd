// SPDX-License-Identifier: MIT
// Joints of a skin of a glTF file, and their animation.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

#include "server/meshes/gltf_primitive.h"
#include "server/meshes/mesh_file.h"
#include "server/model/skin.h"

namespace clothstream::meshes {

struct GltfSkeleton {
  // Without vertices. A parent comes before its children, in contrast to the file. The joints rest where the
  // file binds them to the vertices. The keys are those of the animation. Without an animation, two keys have
  // the poses of the nodes.
  model::Skin skin;
  std::vector<std::uint8_t> numberOf;  // in `skin`, of each joint of the file
  double scale = 1;  // of the vertices: nodes above the joints may have a scale, which joints have not
};

// Nodes may be rotated, moved, and scaled by the same factor along all axes. An animation may move and rotate
// them, and a constant scale is accepted. Interpolation is linear or in steps. Rotations of more than 30
// degrees between two keys get keys between, so that they follow the arc.
[[nodiscard]] tl::expected<GltfSkeleton, std::string> readSkeleton(const tinygltf::Model& model, int skin,
                                                                   const JointRequest& request);

// Joints and weights of the vertices of a primitive, which `read` has, with that skeleton, at most four of
// each vertex. Weights are scaled so that the sum of each vertex is 1.
[[nodiscard]] tl::expected<std::vector<model::VertexJoints>, std::string> readVertexJoints(
    const tinygltf::Model& model, const tinygltf::Primitive& primitive, const GltfPrimitive& read,
    const GltfSkeleton& skeleton);

}  // namespace clothstream::meshes
