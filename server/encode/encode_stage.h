// SPDX-License-Identifier: MIT
// Recording and coding of a frame. Slots, kinds and references belong to FrameEncoder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "server/encode/frame_encoder.h"

namespace clothstream::encode {

inline constexpr std::uint32_t kFrameSlots = FrameEncoder::kSlots;

// record() belongs to the device's thread, entropyCode() to one other thread at a time (or the same).
class EncodeStage {
 public:
  virtual ~EncodeStage() = default;
  virtual std::size_t packetBound() const = 0;
  // Called after a barrier, in the stage "encode".
  virtual void record(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted) = 0;
  // Called once for each frame, in the order of record().
  virtual EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out) = 0;
};

std::unique_ptr<EncodeStage> makeHierarchicalHostStage(const vulkan::Device& device,
                                                       const simulation::ClothSimulation& simulation,
                                                       const codec::StreamLayout& layout,
                                                       std::unique_ptr<codec::Encoder> encoder);
// Throws std::runtime_error if DevicePredictor does not support the layout.
std::unique_ptr<EncodeStage> makeHierarchicalDeviceStage(const vulkan::Device& device,
                                                         const simulation::ClothSimulation& simulation,
                                                         const codec::StreamLayout& layout);

}  // namespace clothstream::encode
