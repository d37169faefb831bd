// SPDX-License-Identifier: MIT
// Depths of nodes inside colliders, measured on the device.
#include "server/simulation/motion_bound/depth_meter.h"

#include "kernels/measure_depths.h"
#include "server/simulation/collision/moving_collider.h"
#include "shaders/motion_bound/motion_bound.h"

namespace clothstream::simulation {

DepthMeter::DepthMeter(const vulkan::Device& device, std::uint32_t nodeCount, const vulkan::Buffer& parts,
                       const StateBuffers& state, std::uint32_t workgroupSize)
    : nodeCount_(nodeCount),
      depths_(device, vulkan::BufferPurpose::state, kMaxColliders * sizeof(float)),
      readback_(device, vulkan::BufferPurpose::readback, 2 * kMaxColliders * sizeof(float)),
      measure_(bindStates(device, {device, kernels::measure_depths, workgroupSize}, [&](std::size_t of) {
        return BufferList{&parts, state.positions[of], &depths_, &state.colliders, &state.nearColliders};
      })) {}

void DepthMeter::recordClear(vulkan::Recorder& recorder) const {
  recorder.fill(depths_, 0, depths_.bytes());
}

void DepthMeter::record(vulkan::Recorder& recorder, std::uint32_t present, float touch,
                        const shared::CollisionPush& collision) const {
  if (collision.colliderCount == 0) return;
  recorder.dispatch(
      measure_[present],
      shared::DepthPush{
          .collision = collision, .nodeCount = nodeCount_, .touch = touch, .reserved0 = 0, .reserved1 = 0},
      nodeCount_, collision.nodeWork);
}

void DepthMeter::recordReport(vulkan::Recorder& recorder, std::uint32_t slot) const {
  recorder.copy(depths_, readback_, depths_.bytes(), 0, slot * depths_.bytes());
}

std::span<const float> DepthMeter::depths(std::uint32_t slot) const {
  return readback_.mapped<const float>().subspan(std::size_t{slot} * kMaxColliders, kMaxColliders);
}

}  // namespace clothstream::simulation
