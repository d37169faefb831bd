// SPDX-License-Identifier: MIT
// Self-collision on the device: nodes as balls that keep out of each other, within and between cloths.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"
#include "shaders/self_collision/self_collision.h"

namespace clothstream::simulation {

// Belongs to the device's thread. Runs behind all that moves nodes in a substep and corrects what that wrote,
// in place. Three times a tick it lists who may touch whom until the next time (a counting sort into cells,
// whose order depends on the state alone); every substep it looks which of these do and puts them apart. What
// is to keep cloth free of penetrations takes the place of recordContacts().
//
// A tick:   recordClear -> (substeps: recordSubstep) -> recordReport
class SelfCollisionStage {
 public:
  // Some cloth must have self-collision. `workgroupSize`: 0 for the measured best; the results do not depend
  // on it.
  SelfCollisionStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
                     std::uint32_t workgroupSize);

  static bool isIn(const model::Scene& scene);

  // Other radii and frictions for the cloths that have self-collision. No tick may be in flight.
  void setCloths(std::span<const model::Cloth> cloths);

  // Its tables, once, before the first tick.
  void recordTables(vulkan::Recorder& recorder) const;
  // The tick's report begins anew; a barrier must follow.
  void recordClear(vulkan::Recorder& recorder) const;
  // Substep `index` of a tick, which led from state `from` to the other one. Begins with a barrier.
  void recordSubstep(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t index,
                     const shared::CollisionPush& collision) const;

  // To the CPU, behind a barrier; and there once the recording is complete.
  void recordReport(vulkan::Recorder& recorder, std::uint32_t slot) const;
  const shared::CrowdReport& report(std::uint32_t slot) const;

  // For tests: a node's list as gather_neighbours.comp leaves it, kNeighbourStride floats a node.
  const vulkan::Buffer& neighbours() const { return neighbours_; }

 private:
  // A kernel bound to either state.
  struct Kernel {
    template <typename Bind>
    Kernel(const vulkan::Device& device, const vulkan::KernelDescription& description, const Bind& bind)
        : kernel(device, description), on{bind(kernel, 0), bind(kernel, 1)} {}
    Kernel(const Kernel&) = delete;
    Kernel& operator=(const Kernel&) = delete;

    vulkan::Kernel kernel;
    std::array<vulkan::Bindings, 2> on;  // the state of this index
  };

  // Kernels of contacts, for when all cloths are alike and for when they are not.
  struct Contacts {
    Contacts(const vulkan::Device& device, const StateBuffers& state, const SelfCollisionStage& stage,
             bool several);
    Kernel count, resolve;
  };
  void makeContacts(std::span<const model::Cloth> cloths);

  void recordNeighbours(vulkan::Recorder& recorder, std::uint32_t state) const;
  void recordContacts(vulkan::Recorder& recorder, std::uint32_t state,
                      const shared::CollisionPush& collision) const;

  const vulkan::Device& device_;
  const StateBuffers state_;
  std::uint32_t workgroupSize_;
  std::uint32_t nodeCount_, cellCount_, measureInvocations_;
  std::uint32_t interval_;  // substeps that lists are for
  float substepSeconds_, reach_;
  vulkan::Buffer restsUpload_, rests_;
  vulkan::Buffer table_, starts_, entries_, order_, sorted_, neighbours_;
  vulkan::Buffer contactPositions_, contactVelocities_, contacts_, touching_, groups_;
  vulkan::Buffer report_, reportReadback_;
  Kernel measure_, countCells_, startCells_, fillCells_, sortCells_, gather_;
  std::array<std::unique_ptr<Contacts>, 2> contactKernels_;
  std::size_t several_ = 0;  // which of them
};

}  // namespace clothstream::simulation
