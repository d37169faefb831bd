// SPDX-License-Identifier: MIT
// Self-collision on the device: nodes are balls that repel each other within a cloth and between cloths.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/self_collision/self_collision.h"

namespace clothstream::simulation {

// Belongs to the device's thread. Runs after all other stages of a substep and corrects their result in
// place. Three times per tick it lists the nodes that may touch until the next search. The search is a
// counting sort into cells, whose order depends only on the state. In every substep it separates the listed
// nodes that touch. A method that keeps cloth free of penetrations would replace recordContacts().
class SelfCollisionStage final : public Stage {
 public:
  // At least one cloth must have self-collision. `workgroupSize` 0: the measured best. The results do not
  // depend on it.
  SelfCollisionStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
                     std::uint32_t workgroupSize);

  static bool isIn(const model::Scene& scene);

  // Sets radii and frictions of the cloths that have self-collision.
  void setCloths(std::span<const model::Cloth> cloths) override;

  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;
  void recordReport(vulkan::Recorder& recorder, const Tick& tick) override;
  // Report of the tick with this slot, once it is complete.
  const shared::CrowdReport& report(std::uint32_t slot) const;

  // For tests: the lists of gather_neighbours.comp, kNeighbourStride floats per node.
  const vulkan::Buffer& neighbours() const { return neighbours_; }

 private:
  // Kernels of contacts, for equal and for different materials of the cloths.
  struct Contacts {
    Contacts(const vulkan::Device& device, const StateBuffers& state, const SelfCollisionStage& stage,
             bool several);
    StateBindings count, resolve;
  };
  void makeContacts(std::span<const model::Cloth> cloths);

  void recordTables(vulkan::Recorder& recorder) override;
  void recordNeighbours(vulkan::Recorder& recorder, const Substep& substep, std::uint32_t interval) const;
  void recordContacts(vulkan::Recorder& recorder, const Substep& substep) const;

  const vulkan::Device& device_;
  const StateBuffers state_;
  std::uint32_t workgroupSize_;
  std::uint32_t nodeCount_, cellCount_, measureInvocations_;
  float reach_;
  vulkan::Buffer restsUpload_, rests_;
  vulkan::Buffer table_, starts_, entries_, order_, sorted_, neighbours_;
  vulkan::Buffer contactPositions_, contactVelocities_, contacts_, touching_, groups_;
  vulkan::Buffer report_, reportReadback_;
  StateBindings measure_, countCells_, startCells_, fillCells_, sortCells_, gather_;
  std::array<std::unique_ptr<Contacts>, 2> contactKernels_;
  std::size_t several_ = 0;  // index of the kernels in use
};

}  // namespace clothstream::simulation
