// SPDX-License-Identifier: MIT
// Measures the speed of a device with small simulations.
#pragma once

#include "server/model/price.h"
#include "server/simulation/cloth_simulation.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Belongs to the device's thread.
class SpeedMeter {
 public:
  // Uploads two grids. Throws std::runtime_error if the device has no room for them.
  explicit SpeedMeter(vulkan::Device& device);

  // Runs a few ticks of each grid and takes the shortest of each. Takes some milliseconds on an idle device.
  // Throws vulkan::DeviceLost.
  model::DeviceSpeed measure();

 private:
  // A sheet that hangs at rest.
  struct Sheet {
    Sheet(vulkan::Device& device, std::uint32_t size, std::uint32_t substeps);
    // Shortest time of some ticks, in seconds.
    double measure();

    vulkan::Device& device;
    model::Scene scene;
    ClothSimulation simulation;
    vulkan::Recorder recorder;
  };

  const bool gpu_;
  double workgroupFactor_;
  Sheet few_, many_;
};

}  // namespace clothstream::simulation
