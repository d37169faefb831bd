// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_skin.h"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "server/meshes/gltf_name.h"
#include "server/meshes/gltf_primitive.h"

namespace clothstream::meshes {
namespace {

using Eigen::Affine3d;
template <typename T>
using Expected = tl::expected<T, std::string>;

constexpr int kRoot = -1, kTwoParents = -2;
// Joints are numbered by unsigned shorts at most.
constexpr std::size_t kMostJoints = std::numeric_limits<std::uint16_t>::max() + std::size_t{1};
constexpr std::size_t kMostSets = 8;   // of four joints
constexpr float kMostWeight = 1.001f;  // quantised weights may be a little above 1

bool isUnsigned(int componentType) {
  return componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE ||
         componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
}

// Compressed numbers are decoded to floats. One that is no joint becomes too large.
std::uint32_t jointAt(const GltfElements& joints, std::size_t vertex, std::size_t k) {
  if (joints.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE)
    return joints.at<std::uint8_t>(vertex, k);
  if (joints.componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT)
    return joints.at<std::uint16_t>(vertex, k);
  const auto number = joints.at<float>(vertex, k);
  return number >= 0 && number < static_cast<float>(kMostJoints) ? static_cast<std::uint32_t>(number)
                                                                 : static_cast<std::uint32_t>(kMostJoints);
}

// Four numbers for each vertex.
Expected<GltfElements> attributeOf(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                                   const GltfPrimitive& read, const std::string& name) {
  if (const auto decoded = read.vectors.find(name); decoded != read.vectors.end())
    return GltfElements{reinterpret_cast<const unsigned char*>(decoded->second.data()),
                        sizeof(Eigen::Vector4f), decoded->second.size(), TINYGLTF_COMPONENT_TYPE_FLOAT,
                        false};
  const auto found = primitive.attributes.find(name);
  if (found == primitive.attributes.end()) return tl::unexpected(fmt::format("has a skin, but no {}", name));
  auto elements = elementsOf(model, found->second, TINYGLTF_TYPE_VEC4);
  if (elements && elements->count != read.positions.size())
    return tl::unexpected(
        fmt::format("has {} elements of {} for {} vertices", elements->count, name, read.positions.size()));
  if (elements && name.starts_with("JOINTS_") && !isUnsigned(elements->componentType))
    return tl::unexpected(std::string("has joints that are not unsigned bytes or shorts"));
  return elements;
}

}  // namespace

Affine3d localTransform(const tinygltf::Node& node) {
  Affine3d transform = Affine3d::Identity();
  if (node.matrix.size() == 16) {
    transform.matrix() = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
    return transform;
  }
  if (node.translation.size() == 3)
    transform.translate(Eigen::Vector3d(node.translation[0], node.translation[1], node.translation[2]));
  if (node.rotation.size() == 4)
    transform.rotate(
        Eigen::Quaterniond(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]));
  if (node.scale.size() == 3) transform.scale(Eigen::Vector3d(node.scale[0], node.scale[1], node.scale[2]));
  return transform;
}

NodeTransforms::NodeTransforms(const tinygltf::Model& model)
    : model_(model), parents_(model.nodes.size(), kRoot), known_(model.nodes.size()) {
  for (std::size_t i = 0; i < model.nodes.size(); ++i)
    for (const int child : model.nodes[i].children)
      if (elementAt(model.nodes, child)) {
        int& parent = parents_[static_cast<std::size_t>(child)];
        parent = parent == kRoot ? static_cast<int>(i) : kTwoParents;
      }
}

Expected<Affine3d> NodeTransforms::of(int node) {
  if (!elementAt(model_.nodes, node)) return tl::unexpected(fmt::format("node {} does not exist", node));
  std::vector<std::size_t> branch;  // nodes whose transform is not known, from `node` up
  auto at = static_cast<std::size_t>(node);
  while (!known_[at]) {
    branch.push_back(at);
    if (parents_[at] == kRoot) break;
    if (parents_[at] == kTwoParents || branch.size() > parents_.size())
      return tl::unexpected(fmt::format("node {} has two parents or is its own ancestor", at));
    at = static_cast<std::size_t>(parents_[at]);
  }
  for (; !branch.empty(); branch.pop_back()) {
    const std::size_t next = branch.back();
    const Affine3d local = localTransform(model_.nodes[next]);
    known_[next] =
        parents_[next] == kRoot ? local : *known_[static_cast<std::size_t>(parents_[next])] * local;
  }
  return *known_[static_cast<std::size_t>(node)];
}

Expected<std::vector<Affine3d>> jointMatrices(const tinygltf::Model& model, int skin, NodeTransforms& nodes) {
  const tinygltf::Skin* found = elementAt(model.skins, skin);
  if (!found) return tl::unexpected(fmt::format("skin {} does not exist", skin));
  const auto refuse = [&](const std::string& text) {
    return tl::unexpected(
        fmt::format("{}: {}", namedPart("skin", found->name, static_cast<std::size_t>(skin)), text));
  };
  const std::size_t count = found->joints.size();
  if (count == 0 || count > kMostJoints)
    return refuse(fmt::format("has {} joints; must have 1 to {}", count, kMostJoints));
  std::vector<float> back;
  if (found->inverseBindMatrices >= 0) {
    auto read = readFloats(model, found->inverseBindMatrices, TINYGLTF_TYPE_MAT4, kMostJoints,
                           "inverse bind matrices");
    if (!read) return refuse(read.error());
    back = std::move(*read);
    if (back.size() < 16 * count)
      return refuse(fmt::format("has {} inverse bind matrices for {} joints", back.size() / 16, count));
  }
  std::vector<Affine3d> matrices;
  for (std::size_t i = 0; i < count; ++i) {
    const Expected<Affine3d> node = nodes.of(found->joints[i]);
    if (!node) return refuse(node.error());
    Affine3d matrix = *node;
    if (!back.empty())
      matrix = matrix * Affine3d(Eigen::Map<const Eigen::Matrix4f>(&back[16 * i]).cast<double>());
    matrices.push_back(matrix);
  }
  return matrices;
}

Expected<VertexInfluences> VertexInfluences::read(const tinygltf::Model& model,
                                                  const tinygltf::Primitive& primitive,
                                                  const GltfPrimitive& read, std::size_t joints) {
  VertexInfluences influences;
  influences.joints_ = joints;
  const auto has = [&](const char* name, std::size_t i) {
    return primitive.attributes.contains(fmt::format("{}_{}", name, i));
  };
  for (std::size_t i = 0; i == 0 || has("JOINTS", i) || has("WEIGHTS", i); ++i) {
    if (i == kMostSets)
      return tl::unexpected(
          fmt::format("has more than {} joints for a vertex: export it with at most four", 4 * kMostSets));
    auto numbers = attributeOf(model, primitive, read, fmt::format("JOINTS_{}", i));
    if (!numbers) return tl::unexpected(std::move(numbers.error()));
    auto weights = attributeOf(model, primitive, read, fmt::format("WEIGHTS_{}", i));
    if (!weights) return tl::unexpected(std::move(weights.error()));
    if (!component(*weights, 0, 0))
      return tl::unexpected(std::string("has weights of a type that glTF does not have"));
    influences.sets_.push_back({*numbers, *weights});
  }
  return influences;
}

Expected<std::span<const Influence>> VertexInfluences::of(std::size_t vertex) {
  found_.clear();
  double sum = 0;
  for (const Set& set : sets_)
    for (std::size_t k = 0; k < 4; ++k) {
      const float weight = component(set.weights, vertex, k).value_or(0);
      if (!(weight >= 0 && weight <= kMostWeight))
        return tl::unexpected(fmt::format("vertex {} has the weight {}; must be 0 to 1", vertex, weight));
      if (weight == 0) continue;
      const std::uint32_t joint = jointAt(set.joints, vertex, k);
      if (joint >= joints_)
        return tl::unexpected(
            fmt::format("vertex {} has joint {}; the skin has {} joints", vertex, joint, joints_));
      found_.push_back({joint, weight});
      sum += double{weight};
    }
  if (found_.empty())
    return tl::unexpected(
        fmt::format("vertex {} has no weight; its weights must add up to 1: assign it to a joint", vertex));
  for (Influence& influence : found_) influence.weight = static_cast<float>(double{influence.weight} / sum);
  return std::span<const Influence>(found_);
}

Expected<void> placeByJoints(const tinygltf::Model& model, const tinygltf::Primitive& primitive,
                             std::span<const Affine3d> matrices, GltfPrimitive& read) {
  auto influences = VertexInfluences::read(model, primitive, read, matrices.size());
  if (!influences) return tl::unexpected(std::move(influences.error()));
  for (std::size_t i = 0; i < read.positions.size(); ++i) {
    const auto joints = influences->of(i);
    if (!joints) return tl::unexpected(joints.error());
    const Eigen::Vector3d bound = read.positions[i].cast<double>();
    Eigen::Vector3d placed = Eigen::Vector3d::Zero();
    for (const Influence& influence : *joints)
      placed += double{influence.weight} * (matrices[influence.joint] * bound);
    read.positions[i] = placed.cast<float>();
  }
  return {};
}

}  // namespace clothstream::meshes
