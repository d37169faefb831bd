// SPDX-License-Identifier: MIT
// Search on the device for nodes that may touch.
#pragma once

#include <cstdint>

#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/self_collision/self_collision.h"

namespace clothstream::simulation {

// Lists for each node the nodes that it may touch until the next search. The search is a counting sort into
// cells, whose order depends only on the state. Belongs to the device's thread.
class NeighbourSearch {
 public:
  // `rests` has a shared::RestRecord for each node, and `report` is a shared::CrowdReport that counts what
  // was too long. These and the state outlive the object. The results do not depend on `workgroupSize`.
  NeighbourSearch(const vulkan::Device& device, std::uint32_t nodeCount, const vulkan::Buffer& rests,
                  const StateBuffers& state, const vulkan::Buffer& report, std::uint32_t workgroupSize);

  // Lists the neighbours in the state buffers `state`, for velocities that apply for `aheadSeconds`. `reach`
  // is the largest sum of two radii, in metres. Begins with a barrier.
  void record(vulkan::Recorder& recorder, std::uint32_t state, float aheadSeconds, float reach) const;

  // The lists of gather_neighbours.comp, kNeighbourStride floats per node.
  const vulkan::Buffer& lists() const { return neighbours_; }

 private:
  std::uint32_t nodeCount_, cellCount_;
  vulkan::Buffer table_, starts_, entries_, order_, sorted_, neighbours_;
  StateBindings measure_, countCells_, startCells_, fillCells_, sortCells_, gather_;
};

}  // namespace clothstream::simulation
