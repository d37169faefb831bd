// SPDX-License-Identifier: MIT
// Masses that change while a scene runs.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_memory.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// The masses of all nodes. States have the inverse mass of a node in the w of its position; a change is
// uploaded like a table.
class MassStage final : public Stage {
 public:
  MassStage(const vulkan::Device& device, std::span<const model::Cloth> cloths, const StateMemory& state);

  // Makes what setCloths() needs if these cloths have other masses. Throws std::runtime_error if the device
  // has too little memory.
  void prepare(std::span<const model::Cloth> cloths);
  // Needs prepare().
  void setCloths(std::span<const model::Cloth> cloths) override;

  // 1/kg, by node; 0 for pinned nodes.
  std::span<const float> inverseMasses() const { return inverseMasses_; }

 private:
  void recordTables(vulkan::Recorder& recorder) override;

  const vulkan::Device& device_;
  const StateMemory& state_;
  std::vector<float> masses_;         // kg, of the cloths
  std::vector<float> inverseMasses_;  // 1/kg, of the nodes
  vulkan::Buffer upload_;
  std::vector<vulkan::Bindings> bindings_;  // of both states and the checkpoint; made for the first change
};

}  // namespace clothstream::simulation
