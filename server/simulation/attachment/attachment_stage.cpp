// SPDX-License-Identifier: MIT
// Kernels of attachments, tethers and grabs.
#include "server/simulation/attachment/attachment_stage.h"

#include <algorithm>
#include <cassert>
#include <cstring>

#include "kernels/aim_attachments.h"
#include "kernels/begin_grabs.h"
#include "kernels/carry_nodes.h"
#include "kernels/find_nearest_nodes.h"
#include "kernels/pull_nodes.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr float kNoSlip = 1e18f;  // m, more than any distance in the world; its square is finite
constexpr std::size_t kGrabBytes = kMaxGrabs * sizeof(shared::GrabRecord);

float stateOf(const Grab& grab) {
  switch (grab.state) {
    case Grab::State::holds:
      return shared::kActiveGrab;
    case Grab::State::takes:
      return grab.place ? shared::kBeginningGrabAtPlace : shared::kBeginningGrab;
    default:
      return shared::kReleasedGrab;
  }
}

// The grab rotates the shorter way.
shared::GrabRecord recordOf(const Grab& grab) {
  const model::Vec3& start = grab.start.position;
  const model::Vec3 motion = grab.end.position - start;
  const Eigen::Vector4f from = grab.start.orientation.coeffs();
  const Eigen::Vector4f to = grab.end.orientation.coeffs();
  const Eigen::Vector4f turn = (from.dot(to) < 0 ? Eigen::Vector4f(-to) : to) - from;
  const WeightedNodes place = grab.place.value_or(WeightedNodes{});
  const float slip = grab.leftAtEnd > 0 ? kNoSlip : grab.slipDistance;
  return {.position = vectorOf(start),
          .squaredSlip = slip * slip,
          .motion = vectorOf(motion),
          .force = grab.maxForce,
          .orientation = texel(grab.start.orientation),
          .orientationChange = {turn.x(), turn.y(), turn.z(), turn.w()},
          .state = stateOf(grab),
          .squaredRadius = grab.radius * grab.radius,
          .squaredReach = grab.reach * grab.reach,
          .left = grab.leftAtStart,
          .nodes = {static_cast<float>(place.nodes[0]), static_cast<float>(place.nodes[1]),
                    static_cast<float>(place.nodes[2])},
          .leftChange = grab.leftAtEnd - grab.leftAtStart,
          .weights = {place.weights[0], place.weights[1], place.weights[2]},
          .reserved = 0};
}

}  // namespace

AttachmentStage::AttachmentStage(const vulkan::Device& device, const AttachmentTables& tables,
                                 const StateBuffers& state, std::span<const std::uint32_t> clothOffsets,
                                 std::uint32_t workgroupSize)
    : clothOffsets_(clothOffsets.begin(), clothOffsets.end()),
      nodeCount_(clothOffsets.back()),
      attachedCount_(static_cast<std::uint32_t>(tables.attached.size())),
      attached_(device, tables.attached),
      tethers_(device, tables.tethers),
      startFrames_(tables.frames),
      frames_(device, BufferPurpose::texels,
              std::max<std::size_t>(1, tables.frames.size()) * sizeof(shared::FrameRecord)),
      grabs_(device, BufferPurpose::texels, kGrabBytes),
      grabbed_(device, nodeCount_),
      uploads_{Buffer(device, BufferPurpose::upload, frames_.bytes() + kGrabBytes),
               Buffer(device, BufferPurpose::upload, frames_.bytes() + kGrabBytes)},
      carry_(bindStates(device, {device, kernels::carry_nodes, workgroupSize},
                        [&](std::size_t from) {
                          return BufferList{state.positions[from], state.velocities[from]};
                        })),
      aim_(bindStates(
          device, {device, kernels::aim_attachments, workgroupSize},
          [&](std::size_t from) {
            return BufferList{&attached_.texels(), &frames_, state.positions[from], state.velocities[from]};
          })),
      findNearest_(bindStates(device, {device, kernels::find_nearest_nodes, workgroupSize},
                              [&](std::size_t from) {
                                return BufferList{&grabs_, &grabbed_.reports(), state.positions[from]};
                              })),
      beginGrabs_(bindStates(
          device, {device, kernels::begin_grabs, workgroupSize},
          [&](std::size_t from) {
            return BufferList{&grabs_, &grabbed_.reports(), state.positions[from], &grabbed_.nodes()};
          })),
      tie_(bindPull(device, state, workgroupSize, false)),
      pull_(bindPull(device, state, workgroupSize, true)) {}

// The buffers that do not have the substep's start have its result.
StateBindings AttachmentStage::bindPull(const vulkan::Device& device, const StateBuffers& state,
                                        std::uint32_t workgroupSize, bool grabs) const {
  return bindStates(
      device, {device, kernels::pull_nodes, workgroupSize, {tethers_.empty() ? 0u : 1u, grabs ? 1u : 0u}},
      [&](std::size_t from) {
        const std::size_t to = 1 - from;
        return BufferList{&grabs_,
                          &grabbed_.reports(),
                          &tethers_.texels(),
                          state.positions[to],
                          state.velocities[to],
                          &grabbed_.nodes()};
      });
}

std::uint64_t AttachmentStage::invocations() const {
  constexpr std::uint64_t kMost = 1 << 20;
  return std::min<std::uint64_t>(nodeCount_, kMost);
}

void AttachmentStage::setCloths(std::span<const model::Cloth> cloths) {
  tethers_.setSlack(cloths);
}

void AttachmentStage::recordTables(vulkan::Recorder& recorder) {
  attached_.recordUpload(recorder);
  grabbed_.recordClear(recorder);
}

void AttachmentStage::recordInputs(vulkan::Recorder& recorder, const Tick& tick) {
  const std::vector<model::Pose>& frames = tick.inputs.attachments;
  const std::vector<Grab>& grabs = tick.inputs.grabs;
  assert(frames.empty() || frames.size() == startFrames_.size());
  assert(grabs.size() <= kMaxGrabs);
  tethers_.recordUpload(recorder);
  const Buffer& through = uploads_[tick.slot];
  const std::span<shared::FrameRecord> frameRecords = through.mapped<shared::FrameRecord>();
  for (std::size_t i = 0; i < startFrames_.size(); ++i)
    frameRecords[i] = frames.empty() ? startFrames_[i] : frameRecord(frames[i]);
  if (!startFrames_.empty()) recorder.copy(through, frames_, frames_.bytes());
  grabCount_ = static_cast<std::uint32_t>(grabs.size());
  takes_ = false;
  if (grabs.empty()) return;
  for (std::size_t i = 0; i < grabs.size(); ++i) {
    const shared::GrabRecord record = recordOf(grabs[i]);
    std::memcpy(through.mapped().data() + frames_.bytes() + i * sizeof(record), &record, sizeof(record));
    if (grabs[i].state != Grab::State::takes) continue;
    takes_ = true;
    grabbed_.recordBegin(recorder, i);
  }
  recorder.copy(through, grabs_, grabs.size() * sizeof(shared::GrabRecord), frames_.bytes());
}

void AttachmentStage::recordCarries(vulkan::Recorder& recorder, std::uint32_t present,
                                    std::span<const model::Carry> carries) const {
  for (const model::Carry& carry : carries) {
    const std::uint32_t first = clothOffsets_[carry.cloth], count = clothOffsets_[carry.cloth + 1] - first;
    recorder.dispatch(carry_[present],
                      shared::CarryPush{.from = vectorOf(carry.from.position),
                                        .firstNode = first,
                                        .to = vectorOf(carry.to.position),
                                        .nodeCount = count,
                                        .fromOrientation = texel(carry.from.orientation),
                                        .toOrientation = texel(carry.to.orientation)},
                      count);
  }
}

void AttachmentStage::recordStart(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present) {
  if (attachedCount_ == 0 && !takes_) return;
  recorder.beginStage("attachments");
  recorder.barrier();
  if (!tick.inputs.carries.empty()) {
    recordCarries(recorder, present, tick.inputs.carries);
    recorder.barrier();
  }
  if (attachedCount_ > 0)
    recorder.dispatch(aim_[present], shared::AimPush{attachedCount_, tick.rate, model::kMaxAttachmentSpeed},
                      attachedCount_);
  if (!takes_) return;
  recorder.dispatch(findNearest_[present], shared::GrabPush{nodeCount_, grabCount_}, invocations());
  recorder.barrier();
  recorder.dispatch(beginGrabs_[present], shared::GrabPush{nodeCount_, grabCount_}, invocations());
}

void AttachmentStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  if (tethers_.empty() && grabCount_ == 0) return;
  const shared::CollisionPush& times = substep.collision;
  recorder.barrier();
  recorder.dispatch((grabCount_ > 0 ? pull_ : tie_)[substep.from],
                    shared::PullPush{.nodeCount = nodeCount_,
                                     .progressBefore = times.progressBefore,
                                     .progressAfter = times.progressAfter,
                                     .substepSeconds = times.substepSeconds,
                                     .substepRate = times.substepRate,
                                     .caughtUp = model::kGrabCorrectionFraction},
                    invocations());
}

void AttachmentStage::recordReport(vulkan::Recorder& recorder, const Tick& tick) {
  grabbed_.recordReport(recorder, tick.slot, grabCount_);
}

std::span<const shared::GrabReport> AttachmentStage::report(std::uint32_t slot) const {
  return grabbed_.report(slot, grabCount_);
}

void AttachmentStage::recordRestore(vulkan::Recorder& recorder, const HeldNodes& held) {
  // A state that is saved before the next tick has the same grabs.
  grabCount_ = static_cast<std::uint32_t>(held.grabs.size());
  grabbed_.recordRestore(recorder, held);
}

}  // namespace clothstream::simulation
