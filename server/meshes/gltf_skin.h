// SPDX-License-Identifier: MIT
// Skins of a glTF file: where joints place the vertices of a mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tiny_gltf.h>
#include <tl/expected.hpp>

#include "server/meshes/gltf_accessor.h"
#include "server/meshes/gltf_primitive.h"
#include "server/model/pose.h"

namespace clothstream::meshes {

// Transform of a node relative to its parent.
Eigen::Affine3d localTransform(const tinygltf::Node& node);

// Transforms of nodes relative to the scene. Each is computed once.
class NodeTransforms {
 public:
  explicit NodeTransforms(const tinygltf::Model& model);
  // Refuses a node that does not exist, or that has two parents or is its own ancestor.
  [[nodiscard]] tl::expected<Eigen::Affine3d, std::string> of(int node);

 private:
  const tinygltf::Model& model_;
  std::vector<int> parents_;  // of each node
  std::vector<std::optional<Eigen::Affine3d>> known_;
};

// Transform from a vertex to the scene, for each joint of a skin: the one of its node times its inverse bind
// matrix.
[[nodiscard]] tl::expected<std::vector<Eigen::Affine3d>, std::string> jointMatrices(
    const tinygltf::Model& model, int skin, NodeTransforms& nodes);

struct Influence {
  std::uint32_t joint = 0;  // in the list of the skin
  float weight = 0;
};

// Joints and weights of the vertices of a primitive, in as many pairs of JOINTS_n and WEIGHTS_n as it has.
class VertexInfluences {
 public:
  // `read` has the vertices of the primitive, and must outlive the result. `joints` is the number of joints
  // of the skin.
  [[nodiscard]] static tl::expected<VertexInfluences, std::string> read(const tinygltf::Model& model,
                                                                        const tinygltf::Primitive& primitive,
                                                                        const GltfPrimitive& read,
                                                                        std::size_t joints);

  // Joints of the vertex with weights above 0. The sum of the weights is 1. The result is valid until the
  // next call.
  [[nodiscard]] tl::expected<std::span<const Influence>, std::string> of(std::size_t vertex);

 private:
  struct Set {
    GltfElements joints, weights;
  };
  std::vector<Set> sets_;
  std::size_t joints_ = 0;
  std::vector<Influence> found_;
};

// Moves the positions of a primitive to where the joints place them: the mean of the matrices by the weights
// of the vertex.
[[nodiscard]] tl::expected<void, std::string> placeByJoints(const tinygltf::Model& model,
                                                            const tinygltf::Primitive& primitive,
                                                            std::span<const Eigen::Affine3d> matrices,
                                                            GltfPrimitive& read);

}  // namespace clothstream::meshes
