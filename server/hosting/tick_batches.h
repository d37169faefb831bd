// SPDX-License-Identifier: MIT
// Ticks of several scenes that are submitted together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/hosting/scene_run.h"
#include "server/schedule/clock.h"
#include "server/schedule/divided_time.h"
#include "server/vulkan/batch.h"
#include "server/vulkan/device.h"

namespace clothstream::hosting {

// Belongs to the device's thread. Must be cleared before the device is closed.
class TickBatches {
 public:
  struct Members {
    explicit Members(const vulkan::Device& device) : batch(device) {}
    void add(SceneRun& run);
    // Divides the time that the device worked on the batch by the work of its ticks.
    void divide(schedule::Clock::duration time) { schedule::divideTime(time, work, times); }

    vulkan::Batch batch;
    std::vector<SceneRun*> runs;
    std::vector<double> work;                      // of each run (vulkan::Recorder::work)
    std::vector<schedule::Clock::duration> times;  // part of the device's time of each run, after divide()
    vulkan::TimelineValue submitted = 0;
  };

  // Submits the recorded ticks of these scenes, in batches of about one slice. Throws vulkan::DeviceLost.
  void submit(vulkan::Device& device, std::span<SceneRun* const> runs);
  // Batches that were submitted since end(), in their order.
  std::span<const std::unique_ptr<Members>> inFlight() const { return std::span(batches_).first(used_); }
  // All of them have been waited for.
  void end() { used_ = 0; }
  void clear();

 private:
  // The next batch that is not in flight, empty.
  Members& next(vulkan::Device& device);

  std::vector<std::unique_ptr<Members>> batches_;  // the first ones are in flight
  std::size_t used_ = 0;
};

}  // namespace clothstream::hosting
