// SPDX-License-Identifier: MIT
// Self-collision on the device: nodes are balls that repel each other within a cloth and between cloths.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "server/model/scene.h"
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
//
// A tick:   recordClear -> (substeps: recordSubstep) -> recordReport
class SelfCollisionStage {
 public:
  // At least one cloth must have self-collision. `workgroupSize` 0: the measured best. The results do not
  // depend on it.
  SelfCollisionStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
                     std::uint32_t workgroupSize);

  static bool isIn(const model::Scene& scene);

  // Sets radii and frictions of the cloths that have self-collision. No tick may be in flight.
  void setCloths(std::span<const model::Cloth> cloths);

  // Sets the number of substeps of a tick. No tick may be in flight.
  void setSubsteps(std::uint32_t substeps, double substepSeconds);

  // Uploads the tables, once, before the first tick.
  void recordTables(vulkan::Recorder& recorder) const;
  // Resets the tick's report. The caller records a barrier after it.
  void recordClear(vulkan::Recorder& recorder) const;
  // Records substep `index` of a tick, which led from state `from` to the other state. Begins with a barrier.
  void recordSubstep(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t index,
                     const shared::CollisionPush& collision) const;

  // Copies the report to the CPU, after a barrier; report() has it once the recording is complete.
  void recordReport(vulkan::Recorder& recorder, std::uint32_t slot) const;
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

  void recordNeighbours(vulkan::Recorder& recorder, std::uint32_t state) const;
  void recordContacts(vulkan::Recorder& recorder, std::uint32_t state,
                      const shared::CollisionPush& collision) const;

  const vulkan::Device& device_;
  const StateBuffers state_;
  std::uint32_t workgroupSize_;
  std::uint32_t nodeCount_, cellCount_, measureInvocations_;
  std::uint32_t interval_;  // substeps between searches
  float substepSeconds_, reach_;
  vulkan::Buffer restsUpload_, rests_;
  vulkan::Buffer table_, starts_, entries_, order_, sorted_, neighbours_;
  vulkan::Buffer contactPositions_, contactVelocities_, contacts_, touching_, groups_;
  vulkan::Buffer report_, reportReadback_;
  StateBindings measure_, countCells_, startCells_, fillCells_, sortCells_, gather_;
  std::array<std::unique_ptr<Contacts>, 2> contactKernels_;
  std::size_t several_ = 0;  // index of the kernels in use
};

}  // namespace clothstream::simulation
