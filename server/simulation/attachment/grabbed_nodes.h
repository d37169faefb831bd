// SPDX-License-Identifier: MIT
// Nodes that grabs hold, and the reports of the grabs, on the device.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "server/simulation/attachment/grab.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/attachment/attachment.h"

namespace clothstream::simulation {

GrabStatus statusOf(const shared::GrabReport& report);

// Returns what the grabs with these reports hold. Nodes of other grabs are left out.
HeldNodes heldNodes(std::span<const shared::GrabbedNode> nodes, std::span<const shared::GrabReport> reports);
// Writes the records for which heldNodes() returns `held`, which must be in range. All other nodes are free.
void setHeldNodes(const HeldNodes& held, std::span<shared::GrabbedNode> nodes,
                  std::span<shared::GrabReport> reports);

// Belongs to the device's thread. The caller records a barrier before and after each recording. A number of
// grabs is at most kMaxGrabs.
class GrabbedNodes {
 public:
  // Throws std::runtime_error if the device has too little memory.
  GrabbedNodes(const vulkan::Device& device, std::uint32_t nodeCount);

  // Releases all nodes and clears all reports. Must be recorded before other work.
  void recordClear(vulkan::Recorder& recorder) const;
  // Clears the report of a grab that begins, except its offset.
  void recordBegin(vulkan::Recorder& recorder, std::size_t grab) const;
  // Copies the reports of the first grabs to the CPU. The slot is that of the tick.
  void recordReport(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t grabs) const;
  std::span<const shared::GrabReport> report(std::uint32_t slot, std::uint32_t grabs) const;

  // Copies what the first grabs hold to the CPU. collect() returns it once the recording is complete.
  void recordSave(vulkan::Recorder& recorder, std::uint32_t grabs);
  HeldNodes collect() const;
  // Replaces what grabs hold. `held` must be in range. No earlier recording may be in flight.
  void recordRestore(vulkan::Recorder& recorder, const HeldNodes& held);

  const vulkan::Buffer& nodes() const { return nodes_; }
  const vulkan::Buffer& reports() const { return reports_; }

 private:
  const vulkan::Device& device_;
  vulkan::Buffer nodes_, reports_;
  std::array<vulkan::Buffer, 2> reportReadbacks_;
  vulkan::Buffer readback_, upload_;  // all reports, then all nodes; created when they are first needed
  std::uint32_t savedGrabs_ = 0;      // by the newest recordSave()
};

}  // namespace clothstream::simulation
