// SPDX-License-Identifier: MIT
// Writes the residuals of a frame from the device into its packet.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "proto/codec/body.h"
#include "server/encode/device_predictor.h"
#include "server/vulkan/recorder.h"

namespace clothstream::encode {

// record() belongs to the device's thread, write() to the thread that entropy-codes.
class DeviceOutput {
 public:
  virtual ~DeviceOutput() = default;

  virtual std::size_t packetBound() const = 0;
  // Must follow the predictor's record().
  virtual void record(vulkan::Recorder& recorder, std::uint32_t slot) = 0;

  struct Written {
    std::size_t bytes;
    bool any;  // true: a vertex stays, or has a residual other than 0
  };
  // `weights` is the packet's first section. The recording of the slot must be complete.
  virtual Written write(std::uint32_t slot, const codec::FrameRole& role, std::span<const std::byte> weights,
                        std::span<std::byte> out) = 0;
};

// Codec 2: the CPU codes residuals that are read back. The predictor must outlive the output.
std::unique_ptr<DeviceOutput> makeCodedOutput(const DevicePredictor& predictor,
                                              const codec::StreamLayout& layout);
// Codec 3: the device packs residuals, and the CPU copies the bytes.
std::unique_ptr<DeviceOutput> makePackedOutput(const vulkan::Device& device, const DevicePredictor& predictor,
                                               const codec::StreamLayout& layout);

}  // namespace clothstream::encode
