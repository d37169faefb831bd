// SPDX-License-Identifier: MIT
#include "server/meshes/gltf_vertex_joints.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>

#include "server/meshes/gltf_skin.h"
#include "server/model/skin_transfer.h"

namespace clothstream::meshes {
namespace {

template <typename T>
using Expected = tl::expected<T, std::string>;

model::VertexJoints asTheyAre(std::span<const Influence> influences, const SkinBinding& binding) {
  model::VertexJoints joints;
  for (std::size_t k = 0; k < influences.size(); ++k) {
    joints.joints[k] = binding.numberOf[influences[k].joint];
    joints.weights[k] = influences[k].weight;
  }
  return joints;
}

// The four joints with the largest weights. A joint that is there several times has the sum of its weights.
// Of equal weights, those of the lower joints stay.
model::VertexJoints largest(std::span<const Influence> influences, const SkinBinding& binding) {
  std::vector<std::pair<std::uint8_t, double>> sums;
  for (const Influence& influence : influences) {
    const std::uint8_t joint = binding.numberOf[influence.joint];
    const auto same = std::ranges::find(sums, joint, &std::pair<std::uint8_t, double>::first);
    if (same == sums.end())
      sums.emplace_back(joint, double{influence.weight});
    else
      same->second += double{influence.weight};
  }
  return model::largestJoints(sums);
}

}  // namespace

Expected<std::vector<model::VertexJoints>> readVertexJoints(const tinygltf::Model& model,
                                                            const tinygltf::Primitive& primitive,
                                                            const GltfPrimitive& read,
                                                            const SkinBinding& binding) {
  auto influences = VertexInfluences::read(model, primitive, read, binding.numberOf.size());
  if (!influences) return tl::unexpected(std::move(influences.error()));
  std::vector<model::VertexJoints> result(read.positions.size());
  for (std::size_t i = 0; i < result.size(); ++i) {
    const auto joints = influences->of(i);
    if (!joints) return tl::unexpected(joints.error());
    result[i] =
        joints->size() <= model::kVertexJoints ? asTheyAre(*joints, binding) : largest(*joints, binding);
  }
  return result;
}

}  // namespace clothstream::meshes
