// SPDX-License-Identifier: MIT
// Ticks of several scenes that are submitted together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/hosting/scene_run.h"
#include "server/vulkan/batch.h"
#include "server/vulkan/device.h"

namespace clothstream::hosting {

// Belongs to the device's thread. Must be cleared before the device is closed.
class TickBatches {
 public:
  struct Members {
    explicit Members(const vulkan::Device& device) : batch(device) {}
    vulkan::Batch batch;
    std::vector<SceneRun*> runs;
    vulkan::TimelineValue submitted = 0;  // 0: not submitted
  };

  // Submits the recorded ticks of these scenes, in batches of about one slice. Throws vulkan::DeviceLost.
  void submit(vulkan::Device& device, std::span<SceneRun* const> runs);
  // Batches that are submitted and not ended, in their order.
  std::span<const std::unique_ptr<Members>> inFlight() const { return std::span(batches_).first(used_); }
  // Ends the batches, whose ticks were waited for.
  void end() { used_ = 0; }
  void clear();

 private:
  Members& next(vulkan::Device& device);

  std::vector<std::unique_ptr<Members>> batches_;  // the first ones are in flight
  std::size_t used_ = 0;
};

}  // namespace clothstream::hosting
