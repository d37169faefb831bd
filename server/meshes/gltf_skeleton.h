// SPDX-License-Identifier: MIT
// Joints of the skins of a glTF file, and their animation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

#include "server/meshes/mesh_file.h"
#include "server/model/skin.h"

namespace clothstream::meshes {

// How the vertices of a skin of the file get their joints.
struct SkinBinding {
  std::vector<std::uint8_t> numberOf;  // in GltfSkeleton::skin, of each joint of the file
  // Transform of the vertices to where the skeleton rests. It has a scale where nodes above the joints have
  // one, because joints have not. The first skin is neither moved nor turned.
  Eigen::Affine3d vertices = Eigen::Affine3d::Identity();
};

struct GltfSkeleton {
  // Without vertices. A joint is a node of the file, so skins share joints. A parent comes before its
  // children, in contrast to the file. The joints rest where the file binds them to the vertices. The keys
  // are those of the animation. Without an animation, two keys have the poses of the nodes. No keys if
  // JointRequest::animated is false.
  model::Skin skin;
  std::vector<SkinBinding> bindings;  // one for each skin that was asked for
};

// Greatest distance of an animated joint from a cubic path, relative to its parent: metres of the file, and
// degrees.
inline constexpr double kCurveMetres = 5e-4, kCurveDegrees = 0.1;

// Nodes may be rotated, moved, and scaled by the same factor along all axes. An animation may move and rotate
// them, and a constant scale is accepted. Rotations of more than 30 degrees between two keys get keys
// between, so that they follow the arc. Cubic paths get as many keys as they need. Skins that share a joint
// must bind it at the same place, or their vertices as a whole are moved to where that is so.
[[nodiscard]] tl::expected<GltfSkeleton, std::string> readSkeleton(const tinygltf::Model& model,
                                                                   std::span<const int> skins,
                                                                   const JointRequest& request);

}  // namespace clothstream::meshes
