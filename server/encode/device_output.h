// SPDX-License-Identifier: MIT
// How a frame's residuals get from the device into its packet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "proto/codec/body.h"
#include "server/encode/device_predictor.h"
#include "server/vulkan/recorder.h"

namespace clothstream::encode {

// record() belongs to the device's thread, write() to that which entropy-codes.
class DeviceOutput {
 public:
  virtual ~DeviceOutput() = default;

  virtual std::size_t packetBound() const = 0;
  // After the predictor's.
  virtual void record(vulkan::Recorder& recorder, std::uint32_t slot) = 0;

  struct Written {
    std::size_t bytes;
    bool any;  // a vertex stays or has a residual that is not 0
  };
  // `weights` is the packet's first section; the slot's recording is complete.
  virtual Written write(std::uint32_t slot, const codec::FrameRole& role, std::span<const std::byte> weights,
                        std::span<std::byte> out) = 0;
};

// Codec 2: residuals are read back, and coded on the CPU. The predictor outlives it.
std::unique_ptr<DeviceOutput> makeCodedOutput(const DevicePredictor& predictor,
                                              const codec::StreamLayout& layout);
// Codec 3: the device packs them, the CPU copies bytes.
std::unique_ptr<DeviceOutput> makePackedOutput(const vulkan::Device& device, const DevicePredictor& predictor,
                                               const codec::StreamLayout& layout);

}  // namespace clothstream::encode
