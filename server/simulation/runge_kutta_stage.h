// SPDX-License-Identifier: MIT
// The fourth-order Runge-Kutta method on the device, from steps of explicit Euler.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// Belongs to the device's thread. For scenes in which it integrates every cloth.
class RungeKuttaStage {
 public:
  // `clothOffsets` are the first node of each cloth, then the number of nodes.
  RungeKuttaStage(const vulkan::Device& device, const StateBuffers& state,
                  std::span<const std::uint32_t> clothOffsets);

  // Records an explicit Euler step from state `from` to the other, over this part of a substep.
  using RecordEuler = std::function<void(std::uint32_t from, float part)>;
  // Records one substep from state `from` to the other, including collisions. State `from` stays unchanged.
  void record(vulkan::Recorder& recorder, std::uint32_t from, const shared::CollisionPush& collision,
              const RecordEuler& recordEuler) const;

 private:
  static constexpr std::size_t kStages = 4;

  StateBindings bindCombine(const vulkan::Device& device, const StateBuffers& state,
                            std::uint32_t stage) const;

  std::vector<std::uint32_t> offsets_;
  vulkan::Buffer start_, startVelocities_, sums_, velocitySums_;
  // The steps alternate between the states. The substep may start from either state.
  std::array<StateBindings, kStages> combine_;
};

}  // namespace clothstream::simulation
