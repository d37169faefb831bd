// SPDX-License-Identifier: MIT
#include "server/simulation/cloth_skin/cloth_skin_stage.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <variant>

#include "kernels/carry_skinned_nodes.h"
#include "kernels/place_nodes.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::size_t kClothJointBytes = CLOTHSTREAM_CLOTH_JOINT_TEXELS * kTexelBytes;

// Null if the tick does not have it.
const MovingCollider* colliderOf(const ClothSkinTables::Skinned& skinned, const TickInputs& inputs) {
  const auto found = std::ranges::find_if(inputs.colliders, [&](const MovingCollider& collider) {
    const auto* solid = std::get_if<model::Solid>(&collider.shape);
    return solid != nullptr && *solid == skinned.solid;
  });
  return found == inputs.colliders.end() ? nullptr : &*found;
}

void copyTo(std::span<const model::Transform> transforms, std::span<float> texels) {
  std::size_t at = 0;
  for (const model::Transform& transform : transforms)
    for (const double number : transform) texels[at++] = static_cast<float>(number);
}

}  // namespace

ClothSkinStage::ClothSkinStage(const vulkan::Device& device, ClothSkinTables tables,
                               const StateBuffers& state, std::uint32_t workgroupSize)
    : tables_(std::move(tables)),
      nodes_(device, tables_.nodes),
      transformTexels_(device, BufferPurpose::texels, tables_.transformCount * kClothJointBytes),
      limits_(device, BufferPurpose::texels,
              std::max<std::size_t>(1, tables_.limitCount) * sizeof(shared::LimitRecord)),
      uploads_{Buffer(device, BufferPurpose::upload, transformTexels_.bytes()),
               Buffer(device, BufferPurpose::upload, transformTexels_.bytes())},
      jumps_(tables_.cloths.size()),
      transforms_(model::kMaxJoints),
      carry_(bindStates(device, {device, kernels::carry_skinned_nodes, workgroupSize},
                        [&](std::size_t from) {
                          return BufferList{&nodes_.texels(), &transformTexels_, state.positions[from],
                                            state.velocities[from]};
                        })),
      place_(bindStates(device, {device, kernels::place_nodes, workgroupSize}, [&](std::size_t from) {
        return BufferList{&nodes_.texels(), &transformTexels_, state.positions[from], state.velocities[from],
                          &limits_};
      })) {}

void ClothSkinStage::recordTables(vulkan::Recorder& recorder) {
  nodes_.recordUpload(recorder);
}

void ClothSkinStage::recordInputs(vulkan::Recorder& recorder, const Tick& tick) {
  const Buffer& upload = uploads_[tick.slot];
  for (std::size_t i = 0; i < tables_.cloths.size(); ++i) {
    const ClothSkinTables::Skinned& skinned = tables_.cloths[i];
    const MovingCollider* const collider = colliderOf(skinned, tick.inputs);
    const std::size_t count = skinned.push.jointCount;
    const std::span<model::Transform> transforms = std::span(transforms_).first(count);
    std::uint32_t first = skinned.push.firstJoint - skinned.push.jointCount;
    const auto write = [&](const std::vector<model::Pose>& joints, const model::Pose& frame) {
      model::jointTransforms(skinned.inverseRests, joints.empty() ? skinned.rest : joints, frame, transforms);
      copyTo(transforms, upload.mapped<float>().subspan(std::size_t{12} * first, 12 * count));
      first += skinned.push.jointCount;
    };
    jumps_[i] = collider != nullptr && collider->jumped ? 1 : 0;
    if (collider == nullptr) {
      for (int k = 0; k < 3; ++k) write(skinned.rest, skinned.start);
      continue;
    }
    write(collider->jumped ? collider->jointsBefore : collider->jointsStart,
          collider->jumped ? collider->before : collider->start);
    write(collider->jointsStart, collider->start);
    write(collider->jointsEnd, collider->end);
  }
  recorder.copy(upload, transformTexels_, transformTexels_.bytes());
}

void ClothSkinStage::recordJumps(vulkan::Recorder& recorder, std::uint32_t present) const {
  if (std::ranges::find(jumps_, 1) == jumps_.end()) return;
  for (std::size_t i = 0; i < tables_.cloths.size(); ++i) {
    if (jumps_[i] == 0) continue;
    const ClothSkinTables::Skinned& skinned = tables_.cloths[i];
    recorder.dispatch(carry_[present],
                      shared::SkinJumpPush{.firstRecord = skinned.push.firstRecord,
                                           .count = skinned.nodeCount,
                                           .firstBefore = skinned.push.firstJoint - skinned.push.jointCount,
                                           .firstAfter = skinned.push.firstJoint},
                      skinned.nodeCount);
  }
  recorder.barrier();
}

void ClothSkinStage::recordStart(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present) {
  recorder.beginStage("attachments");
  recorder.barrier();
  recordJumps(recorder, present);
  for (const ClothSkinTables::Skinned& skinned : tables_.cloths) {
    shared::PlacePush push = skinned.push;
    push.tickRate = tick.rate;
    if (const std::uint32_t nodes = push.limitedCount + push.exactCount; nodes > 0)
      recorder.dispatch(place_[present], push, nodes);
  }
}

}  // namespace clothstream::simulation
