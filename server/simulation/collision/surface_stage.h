// SPDX-License-Identifier: MIT
// Collision with surfaces of the real room, at the end of each substep.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/simulation/collision/surface_table.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/free_ranges.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Texels that a tick uploads while surfaces arrive: 1 MiB, so that no tick takes long because of them.
inline constexpr std::size_t kSurfaceUploadTexels = 65'536;

// Surfaces on the device. The buffers have room for those of the largest scene, so that a scene without
// surfaces should not make this stage. Allocates memory only in ticks in which surfaces come or go.
class SurfaceStage final : public Stage {
 public:
  // Throws std::runtime_error if the device has too little memory. Any thread may make the stage.
  SurfaceStage(const vulkan::Device& device, std::span<const std::uint32_t> clothOffsets,
               const StateBuffers& state, std::uint32_t workgroupSize);

  // The kernel, for a first run before ticks use it (vulkan::Recorder::touch).
  const vulkan::Bindings& kernel() const { return collide_[0]; }

  // Texels of the surface that the next recorded tick would still have to upload; 0 if the device has it.
  std::size_t texelsToUpload(const SurfaceTable& table) const;

  // Uploads what is missing of the surfaces that act, and then as much of those that arrive as a tick may.
  // Forgets all others.
  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  // Collides all nodes with the surfaces of the tick.
  void recordSubstep(vulkan::Recorder& recorder, const Substep& substep) override;

 private:
  void recordTables(vulkan::Recorder& recorder) override;

  // A surface that is on the device, or on its way there.
  struct Resident {
    SharedSurface table;
    std::size_t first = 0;     // texel
    std::size_t uploaded = 0;  // texels
  };
  // Part of a surface that a tick uploads.
  struct Part {
    std::size_t resident, first, count;
  };
  const Resident* find(const SurfaceTable& table) const;
  void forgetOthers(const TickInputs& inputs);
  // Gives the surface a place. Returns nothing if there is none.
  std::optional<std::size_t> place(const SharedSurface& table);
  // Places for all surfaces that act. If the free places are too small for one, all begin again.
  void placeActing(const TickInputs& inputs);
  void plan(std::size_t resident, std::size_t most);
  void recordParts(vulkan::Recorder& recorder, std::uint32_t slot);
  void recordSurfaces(vulkan::Recorder& recorder, const Tick& tick);

  const vulkan::Device& device_;
  std::uint32_t workgroupSize_, tileCount_;
  vulkan::Buffer texels_, surfaces_;
  DeviceTable tiles_;
  StateBindings collide_;
  // By Tick::slot. A tick that uploads more than usual, because all surfaces begin again, has a buffer for
  // it.
  std::array<vulkan::Buffer, 2> uploads_, surfaceUploads_;
  vulkan::FreeRanges free_;  // in texels
  std::vector<Resident> residents_;
  std::vector<Part> parts_;  // of the tick that is recorded
  std::uint32_t count_ = 0;  // of the surfaces in the tick
  std::uint64_t work_ = 0;   // of a node with all of them, in node-steps
};

}  // namespace clothstream::simulation
