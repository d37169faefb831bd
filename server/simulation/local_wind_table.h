// SPDX-License-Identifier: MIT
// Local winds of a tick, on the device.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/model/local_wind.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread.
class LocalWindTable {
 public:
  // `count` is that of the first tick. Throws std::runtime_error if the device has too little memory.
  LocalWindTable(const vulkan::Device& device, std::size_t count);

  // Records the upload of at most model::kMaxLocalWinds winds. Their positions are relative to the scene's
  // origin. `slot` is that of the tick.
  void recordUpload(vulkan::Recorder& recorder, std::span<const model::LocalWind> winds, std::uint32_t slot);

  std::uint32_t count() const { return count_; }
  const vulkan::Buffer& texels() const { return texels_; }  // shared::LocalWindRecord

 private:
  std::uint32_t count_;
  vulkan::Buffer texels_;
  std::array<vulkan::Buffer, 2> uploads_;
};

}  // namespace clothstream::simulation
