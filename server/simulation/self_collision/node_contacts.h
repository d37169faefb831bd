// SPDX-License-Identifier: MIT
// Contacts of nodes on the device: separates listed nodes that touch.
#pragma once

#include <array>
#include <cstddef>
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

// Belongs to the device's thread.
class NodeContacts {
 public:
  // These buffers and the state outlive the object.
  struct Inputs {
    const vulkan::Buffer& rests;       // shared::RestRecord by node
    const vulkan::Buffer& neighbours;  // NeighbourSearch::lists()
    const vulkan::Buffer& report;      // shared::CrowdReport, which counts what was too long
  };
  // setCloths() must be called before the first iteration. The results do not depend on `workgroupSize`.
  NodeContacts(const vulkan::Device& device, std::uint32_t nodeCount, const Inputs& inputs,
               const StateBuffers& state, std::uint32_t workgroupSize);

  // Makes the kernels that these materials need.
  void setCloths(std::span<const model::Cloth> cloths);

  // Must be recorded before the first iteration.
  void recordTables(vulkan::Recorder& recorder) const;
  // Records one iteration, which corrects the substep's result in place. Begins with a barrier.
  void record(vulkan::Recorder& recorder, const Substep& substep) const;

 private:
  // Kernels for equal or for different materials of the cloths.
  struct Kernels {
    Kernels(const vulkan::Device& device, const NodeContacts& of, bool several);
    StateBindings count, resolve;
  };

  const vulkan::Device& device_;
  const Inputs inputs_;
  const StateBuffers state_;
  std::uint32_t workgroupSize_, nodeCount_;
  vulkan::Buffer positions_, velocities_;  // of the nodes at the start of the iteration
  vulkan::Buffer contacts_, touching_, groups_;
  std::array<std::unique_ptr<Kernels>, 2> kernels_;
  std::size_t several_ = 0;  // index of the kernels in use
};

}  // namespace clothstream::simulation
