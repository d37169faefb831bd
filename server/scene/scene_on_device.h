// SPDX-License-Identifier: MIT
// Device objects of one scene: simulation, encoders, recorder with its slices, and the start state.
#pragma once

#include <stop_token>

#include "server/encode/quality_encoders.h"
#include "server/model/scene.h"
#include "server/scene/slices.h"
#include "server/simulation/cloth_simulation.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::scene {

// Belongs to one thread at a time. Other threads may use the device at the same time.
struct SceneOnDevice {
  // Uploads the scene, runs every kernel once and restores the start state. `device` and `workers` must
  // outlive it. Takes up to seconds, but occupies the device only for short times. Throws std::runtime_error
  // if the device has no room for the scene, or soon after a stop was requested. Room includes allocations
  // that the scenes on the device may need later (kSpareAllocations).
  SceneOnDevice(vulkan::Device& device, const model::Scene& scene, codec::Workers& workers,
                const std::stop_token& stop = {});

  // Allocations of memory that a new scene leaves free: buffers for grabs, reports and coarser qualities of
  // running scenes are made when they are first needed. Buffers share allocations, so that few are enough.
  static constexpr std::uint32_t kSpareAllocations = 16;

  vulkan::Device& device;
  simulation::ClothSimulation simulation;
  encode::QualityEncoders encoders;
  vulkan::Recorder recorder;
  Slices slices;
  simulation::StateSnapshot start;

 private:
  // Throws std::runtime_error after a request to stop.
  void submitAndWait(const std::stop_token& stop);
  // Runs everything that a tick and a frame may need. Software devices compile a kernel when it first runs,
  // which takes up to tenths of a second. Leaves the start state.
  void warmUp(const model::Scene& scene, const std::stop_token& stop);
};

}  // namespace clothstream::scene
