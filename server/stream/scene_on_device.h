// SPDX-License-Identifier: MIT
// What of a scene lives on the device.
#pragma once

#include <stop_token>

#include "server/encode/quality_encoders.h"
#include "server/model/scene.h"
#include "server/simulation/cloth_simulation.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::stream {

// Belongs to one thread at a time, whichever; others may use the device meanwhile.
struct SceneOnDevice {
  // Its start is complete there, every kernel has run, and `start` is that state. The device and `workers`
  // outlive it. Takes up to seconds, the device never much longer than the compiling of a kernel. Throws
  // std::runtime_error where the device has no room for the scene, and soon after a stop was asked for.
  SceneOnDevice(vulkan::Device& device, const model::Scene& scene, codec::Workers& workers,
                const std::stop_token& stop = {});

  vulkan::Device& device;
  simulation::ClothSimulation simulation;
  encode::QualityEncoders encoders;
  vulkan::Recorder recorder;
  simulation::StateSnapshot start;

 private:
  void submitAndWait();
  // All that a tick and a frame may need: software devices compile a kernel when it first runs, which takes
  // up to tenths of a second. Leaves the start state.
  void warmUp(const model::Scene& scene, const std::stop_token& stop);
};

}  // namespace clothstream::stream
