// SPDX-License-Identifier: MIT
// Tree of boxes over the triangles of the cloths, on the device.
#pragma once

#include <cstdint>
#include <vector>

#include "server/simulation/device_table.h"
#include "server/simulation/motion_bound/motion_bound_tables.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// The tree's shape is that of its tables. Its boxes hold the motion of the triangles in a substep. Belongs to
// the device's thread.
class BoxTree {
 public:
  // `faces` has MotionBoundTables::faces; it and the state outlive the object. Throws std::runtime_error if
  // the device has too little memory.
  BoxTree(const vulkan::Device& device, const MotionBoundTables& tables, const vulkan::Buffer& faces,
          const StateBuffers& state, std::uint32_t workgroupSize);

  // Must be recorded before the first fit.
  void recordUpload(vulkan::Recorder& recorder) const { branches_.recordUpload(recorder); }
  // Fits the boxes to the motion from the state buffers `from` to the other ones. Half of `gap`, in metres,
  // is the margin of each box. The caller records a barrier before it.
  void recordFit(vulkan::Recorder& recorder, std::uint32_t from, float gap) const;

  const vulkan::Buffer& boxes() const { return boxes_; }

 private:
  std::uint32_t faceCount_;
  std::vector<std::uint32_t> levels_;  // MotionBoundTables::levels
  DeviceTable branches_;
  vulkan::Buffer boxes_;
  StateBindings boxFaces_;
  vulkan::Bindings boxBranches_;
};

}  // namespace clothstream::simulation
