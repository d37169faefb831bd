// SPDX-License-Identifier: MIT
// Tables of a hierarchy on the device, for the kernels that predict positions.
#pragma once

#include "proto/codec/hierarchical/hierarchy.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::encode {

// The layout is that of shaders/encode/hierarchical/hierarchical.h. Belongs to the device's thread.
class HierarchyTables {
 public:
  // Throws std::runtime_error if the device has too little memory.
  HierarchyTables(const vulkan::Device& device, const codec::hierarchical::Hierarchy& hierarchy);

  // Must be recorded before a kernel reads the tables.
  void recordUpload(vulkan::Recorder& recorder) const;

  const vulkan::Buffer& links() const { return links_; }
  const vulkan::Buffer& slots() const { return slots_; }
  // The weights that predict scales, then the phases.
  const vulkan::Buffer& model() const { return model_; }

 private:
  vulkan::Buffer links_, slots_, model_;
  vulkan::Buffer upload_;  // the three tables in this order
};

}  // namespace clothstream::encode
