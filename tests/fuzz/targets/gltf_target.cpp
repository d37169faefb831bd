// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/gltf_target.h"

#include <algorithm>
#include <vector>

#include "server/meshes/mesh_file.h"
#include "tests/fuzz/targets/built_mesh.h"
#include "tests/fuzz/targets/temporary_file.h"

namespace clothstream::fuzz {
namespace {

constexpr meshes::FileLimits kLimits{.bytes = 1 << 20, .vertices = 16'384};
const meshes::JointRequest kJoints{
    .animation = {}, .joints = 128, .keys = 1024, .poses = 16'384, .attributes = true};

// Checks what the server checks later.
bool isInWorld(const model::Vec3& point) {
  return (point.array().abs() <= 1000).all();
}
bool isInWorld(const model::Skin& skin) {
  const auto isNear = [](const model::Pose& pose) { return isInWorld(pose.position); };
  return std::ranges::all_of(skin.joints, isNear, &model::Joint::rest) &&
         std::ranges::all_of(
             skin.keys, [&](const model::JointKey& key) { return std::ranges::all_of(key.joints, isNear); });
}

// A skin that was accepted moves every vertex to a finite place, at all times of its animation.
void pose(const meshes::MeshSource& source) {
  const model::Skin& skin = *source.skin;
  require(skin.vertices.size() == source.vertices.size(), "every vertex has joints");
  if (!isInWorld(skin)) return;
  std::vector<model::Pose> local, poses;
  for (const double share : {0.0, 0.3, 0.9}) {
    model::jointsAt(skin, share * double{skin.keys.back().time}, local);
    model::compose(skin, local, poses);
    const std::vector<model::Transform> transforms = model::jointTransforms(skin, poses);
    for (std::size_t i = 0; i < source.vertices.size(); ++i)
      require(!isInWorld(source.vertices[i]) ||
                  model::skinned(skin.vertices[i], transforms, source.vertices[i].cast<double>()).allFinite(),
              "joints move vertices to finite places");
  }
}

void checkAttributes(const meshes::MeshSource& source) {
  const auto fits = [&](const auto& list) { return list.empty() || list.size() == source.vertices.size(); };
  const meshes::VertexAttributes& all = source.attributes;
  require(
      fits(all.maxDistances) && fits(all.backstopDistances) && fits(all.backstopRadii) && fits(all.colours),
      "every vertex has an element of an attribute");
}

void run(std::span<const std::byte> input) {
  const bool binary = textOf(input).starts_with("glTF");
  const TemporaryFile file(binary ? ".glb" : ".gltf", input);
  if (const auto source = meshes::readMeshFile(file.path(), kLimits)) buildAndCheck(*source);
  const auto source = meshes::readMeshFile(file.path(), kLimits, &kJoints);
  if (source) checkAttributes(*source);
  if (source && source->skin) pose(*source);
}

}  // namespace

const Target kGltfTarget{.name = "gltf", .run = &run};

}  // namespace clothstream::fuzz
