// SPDX-License-Identifier: MIT
#include "server/simulation/collision/skin_stage.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "kernels/refit_solid.h"
#include "kernels/skin_solid.h"
#include "kernels/weigh_solid.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

// Nodes of a tree below which one invocation refits all nodes.
constexpr std::uint32_t kRefitRoots = 64;
constexpr std::size_t kTransformBytes = CLOTHSTREAM_TRANSFORM_TEXELS * kTexelBytes;

shared::SkinVertexRecord restOf(const model::Vec3& vertex, const model::VertexJoints& by) {
  shared::SkinVertexRecord record{.position = vectorOf(vertex), .reserved = 0, .joints = {}, .weights = {}};
  for (std::size_t k = 0; k < model::kVertexJoints; ++k) {
    record.joints[k] = static_cast<float>(by.joints[k]);
    record.weights[k] = by.weights[k];
  }
  return record;
}

void appendFans(const model::ClosedMesh& mesh, std::vector<shared::vec4>& fans) {
  std::vector<std::vector<shared::vec4>> around(mesh.vertices.size());
  for (const model::TriangleCorners& triangle : mesh.triangles)
    for (std::size_t i = 0; i < 3; ++i)
      around[triangle[i]].push_back(
          {static_cast<float>(triangle[(i + 1) % 3]), static_cast<float>(triangle[(i + 2) % 3]), 0, 0});
  std::size_t next = fans.size() + mesh.vertices.size();
  for (const std::vector<shared::vec4>& fan : around) {
    fans.push_back({static_cast<float>(next), static_cast<float>(fan.size()), 0, 0});
    next += fan.size();
  }
  for (const std::vector<shared::vec4>& fan : around) fans.insert(fans.end(), fan.begin(), fan.end());
}

void write(std::span<const model::Transform> transforms, std::span<float> to) {
  std::size_t at = 0;
  for (const model::Transform& transform : transforms)
    for (const double number : transform) to[at++] = static_cast<float>(number);
}

}  // namespace

SkinTables skinTables(const SolidTables& solids) {
  SkinTables tables;
  for (std::uint32_t i = 0; i < solids.solids.size(); ++i) {
    const model::ClosedMesh& mesh = *solids.solids[i];
    if (!mesh.skin) continue;
    const auto joints = static_cast<std::uint32_t>(mesh.skin->joints.size());
    std::vector<model::Pose> rest;
    model::compose(*mesh.skin, model::restJoints(*mesh.skin), rest);
    tables.skinned.push_back(
        {.solid = i,
         .push = {.vertexCount = static_cast<std::uint32_t>(mesh.vertices.size()),
                  .firstRest =
                      CLOTHSTREAM_SKIN_VERTEX_TEXELS * static_cast<std::uint32_t>(tables.rests.size()),
                  .firstFan = static_cast<std::uint32_t>(tables.fans.size()),
                  .firstVertex = solids.firstVertexOf(i),
                  .firstJoint = tables.transformCount,
                  .jointCount = joints,
                  .reserved0 = 0,
                  .reserved1 = 0},
         .bounds = model::skinBounds(mesh.skin->vertices, mesh.skin->joints.size(), mesh.vertices),
         .inverseRests = model::inverseRests(*mesh.skin),
         .rest = std::move(rest)});
    for (std::size_t k = 0; k < mesh.vertices.size(); ++k)
      tables.rests.push_back(restOf(mesh.vertices[k], mesh.skin->vertices[k]));
    appendFans(mesh, tables.fans);
    tables.transformCount += 2 * joints;
  }
  return tables;
}

SkinStage::SkinStage(const vulkan::Device& device, SkinTables tables, SolidTables& solids,
                     const Buffer& texels, std::uint32_t workgroupSize)
    : tables_(std::move(tables)),
      solids_(solids),
      rests_(device, tables_.rests),
      fans_(device, tables_.fans),
      transformTexels_(device, BufferPurpose::texels, tables_.transformCount * kTransformBytes),
      uploads_{Buffer(device, BufferPurpose::upload, transformTexels_.bytes()),
               Buffer(device, BufferPurpose::upload, transformTexels_.bytes())},
      transforms_(2 * model::kMaxJoints),
      skin_(device, {device, kernels::skin_solid, workgroupSize},
            {&rests_.texels(), &transformTexels_, &texels}),
      weigh_(device, {device, kernels::weigh_solid, workgroupSize}, {&fans_.texels(), &texels, &texels}),
      refit_(device, {device, kernels::refit_solid, workgroupSize}, {&texels, &texels}) {}

void SkinStage::recordTables(vulkan::Recorder& recorder) {
  rests_.recordUpload(recorder);
  fans_.recordUpload(recorder);
}

void SkinStage::recordInputs(vulkan::Recorder& recorder, const Tick& tick) {
  const std::vector<MovingCollider>& colliders = tick.inputs.colliders;
  moves_ = false;
  const Buffer& upload = uploads_[tick.slot];
  for (const SkinTables::Skinned& skinned : tables_.skinned) {
    const model::Solid& solid = solids_.solids[skinned.solid];
    const auto collider = std::ranges::find_if(colliders, [&](const MovingCollider& one) {
      const auto* own = std::get_if<model::Solid>(&one.shape);
      return own != nullptr && *own == solid;
    });
    if (collider == colliders.end()) continue;
    moves_ = true;
    const bool rests = collider->jointsStart.empty();
    const std::size_t joints = skinned.push.jointCount;
    transforms_.resize(2 * joints);
    const auto start = std::span(transforms_).first(joints), end = std::span(transforms_).last(joints);
    model::jointTransforms(skinned.inverseRests, rests ? skinned.rest : collider->jointsStart, start);
    model::jointTransforms(skinned.inverseRests, rests ? skinned.rest : collider->jointsEnd, end);
    write(transforms_, upload.mapped<float>().subspan(std::size_t{12} * skinned.push.firstJoint,
                                                      std::size_t{24} * joints));
    const model::SkinMotion motion = model::motionBetween(skinned.bounds, start, end);
    solids_.reaches[skinned.solid] = motion.reach;
    solids_.motions[skinned.solid] = motion.farthest;
  }
  recorder.copy(upload, transformTexels_, transformTexels_.bytes());
}

void SkinStage::recordRefit(vulkan::Recorder& recorder, const SkinTables::Skinned& skinned,
                            bool upperLevels) const {
  const std::uint32_t leaves = solids_.leafCounts[skinned.solid];
  const std::uint32_t roots = std::min(leaves, kRefitRoots);
  const auto levelsBelow = [](std::uint32_t nodes) {
    return static_cast<std::uint32_t>(std::countr_zero(nodes));
  };
  const shared::RefitPush push{.solid = solids_.places[skinned.solid],
                               .firstRoot = upperLevels ? 1 : roots,
                               .rootCount = upperLevels ? 1 : roots,
                               .levels = upperLevels ? levelsBelow(roots) : levelsBelow(leaves / roots) + 1};
  recorder.dispatch(refit_, push, push.rootCount);
}

// Every dispatch writes to the buffer of all meshes, so barriers are between them.
void SkinStage::recordStart(vulkan::Recorder& recorder, const Tick&, std::uint32_t) {
  if (!moves_) return;
  recorder.beginStage("skins");
  for (const SkinTables::Skinned& skinned : tables_.skinned) {
    recorder.barrier();
    recorder.dispatch(skin_, skinned.push, skinned.push.vertexCount);
    recorder.barrier();
    recorder.dispatch(weigh_, skinned.push, skinned.push.vertexCount);
    recorder.barrier();
    recordRefit(recorder, skinned, false);
    recorder.barrier();
    recordRefit(recorder, skinned, true);
  }
}

}  // namespace clothstream::simulation
