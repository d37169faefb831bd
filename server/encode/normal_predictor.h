// SPDX-License-Identifier: MIT
// Prediction of normals on the device from the positions of the same frame.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "proto/codec/hierarchical/hierarchy.h"
#include "proto/codec/stream_layout.h"
#include "server/encode/encode_stage.h"
#include "server/vulkan/kernel.h"
#include "shaders/encode/hierarchical/hierarchical.h"

namespace clothstream::encode {

// Records on the device's thread. The residuals of a frame belong to the thread that entropy-codes it.
class NormalPredictor {
 public:
  // `normals` are those of the cloths, `moments` two that frames alternate between, and `sent` receives the
  // normals as a decoder has them. These buffers outlive the object. Throws std::runtime_error if the device
  // has too little memory.
  NormalPredictor(const vulkan::Device& device, const codec::StreamLayout& layout,
                  const codec::hierarchical::Hierarchy& hierarchy, const vulkan::Buffer& normals,
                  const std::array<vulkan::Buffer, 2>& moments, const vulkan::Buffer& sent);

  // Must be recorded before the first frame.
  void recordTables(vulkan::Recorder& recorder) const;
  // Records the frame whose positions are in the moment with this index.
  void record(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t moment,
              const shared::PredictPush& push) const;
  // By vertex: residuals of u and v of its normal, a byte each. The slot's recording must be complete.
  std::span<const std::uint32_t> residuals(std::uint32_t slot) const {
    return residuals_[slot].mapped<std::uint32_t>();
  }

 private:
  vulkan::Buffer faces_, facesOf_;
  vulkan::Buffer upload_;  // both tables in this order
  std::array<vulkan::Buffer, kFrameSlots> residuals_;
  std::vector<vulkan::Bindings> bindings_;  // by moment and then slot
};

}  // namespace clothstream::encode
