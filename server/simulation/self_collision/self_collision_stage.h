// SPDX-License-Identifier: MIT
// Self-collision on the device: nodes are balls that repel each other within a cloth and between cloths.
#pragma once

#include <cstdint>
#include <span>

#include "server/model/scene.h"
#include "server/simulation/device_table.h"
#include "server/simulation/self_collision/neighbour_search.h"
#include "server/simulation/self_collision/node_contacts.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/self_collision/self_collision.h"

namespace clothstream::simulation {

// Belongs to the device's thread. Runs after all other stages of a substep and corrects their result in
// place. Three times per tick it lists the nodes that may touch until the next search. In every substep it
// separates the listed nodes that touch. A method that keeps cloth free of penetrations would replace
// NodeContacts.
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
  const vulkan::Buffer& neighbours() const { return search_.lists(); }

 private:
  void recordTables(vulkan::Recorder& recorder) override;

  float reach_;  // m, the largest sum of two radii
  DeviceTable rests_;
  vulkan::Buffer report_, reportReadback_;
  NeighbourSearch search_;
  NodeContacts contacts_;
};

}  // namespace clothstream::simulation
