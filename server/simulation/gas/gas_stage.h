// SPDX-License-Identifier: MIT
// Gas inside closed cloths on the device: model/gas.h.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/gas/gas.h"

namespace clothstream::simulation {

// Belongs to the device's thread. Changes the free motion of a substep, before the solvers. It has tables of
// every cloth that can hold gas, so that gas may come and go while the scene runs. Without gas it does
// nothing.
class GasStage final : public Stage {
 public:
  // `gas`: StateMemory::gas. Throws std::runtime_error if the device has too little memory.
  GasStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
           const vulkan::Buffer& gas, std::uint32_t workgroupSize);

  // True if a cloth of the scene can hold gas.
  static bool isIn(const model::Scene& scene);

  void setCloths(std::span<const model::Cloth> cloths) override;
  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

 private:
  struct Enclosure {
    std::uint32_t cloth, firstNode, nodeCount, firstRecord;
    double volume;          // at rest, m^3
    float pressure = 0;     // at rest, Pa; 0: no gas
    bool collides = false;  // no stage follows
  };
  struct Tables;

  GasStage(const vulkan::Device& device, const Tables& tables, const model::Scene& scene,
           const StateBuffers& state, const vulkan::Buffer& gas, std::uint32_t workgroupSize);

  StateBindings bindPush(const vulkan::Device& device, const StateBuffers& state, std::uint32_t workgroupSize,
                         bool collides) const;
  void recordTables(vulkan::Recorder& recorder) override;
  shared::GasPush pushOf(const Enclosure& enclosure, const Substep& substep) const;

  std::vector<Enclosure> enclosures_;
  DeviceTable nodes_, corners_;
  const vulkan::Buffer& gas_;
  vulkan::Buffer shares_;
  StateBindings measure_;
  vulkan::Bindings solve_;
  std::array<StateBindings, 2> push_;  // without and with collisions
};

}  // namespace clothstream::simulation
