// SPDX-License-Identifier: MIT
// A part of a tick on the device.
#pragma once

#include <cstdint>
#include <span>
#include <utility>

#include "server/model/scene.h"
#include "server/simulation/tick_inputs.h"
#include "server/vulkan/recorder.h"
#include "shaders/collision/collision.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// A tick that is being recorded. At most one other tick is in flight.
struct Tick {
  const TickInputs& inputs;                     // relative to the scene's origin
  std::span<const shared::ClothRecord> cloths;  // with the present parameters
  std::uint32_t substeps = 1;
  double substepSeconds = 0;
  float rate = 0;          // ticks/s
  std::uint32_t slot = 0;  // of the uploads and readbacks of this tick: 0 or 1; ticks alternate
};

struct Substep {
  const Tick& tick;
  std::uint32_t index = 0;  // of tick.substeps
  std::uint32_t from = 0;   // state buffers with its start; the other ones have its result
  shared::CollisionPush collision{};
  std::uint32_t solids = 0;  // colliders that are triangle meshes

  bool isLast() const { return index + 1 == tick.substeps; }
};

// Belongs to the device's thread. ClothSimulation calls each function for all stages of a scene, in their
// order, before it calls the next one:
//
//   uploadTables   recordInputs   recordStart   recordSubstep (for each substep)   recordEnd   recordReport
//
// The buffers that a stage refers to outlive it.
class Stage {
 public:
  Stage() = default;
  virtual ~Stage() = default;
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  // True if uploadTables() may have tables to upload.
  bool isOutdated() const { return outdated_; }
  // Records the upload of the tables unless the device has them. A barrier is before and after it.
  void uploadTables(vulkan::Recorder& recorder) {
    if (std::exchange(outdated_, false)) recordTables(recorder);
  }

  // Parameters of the cloths from the next tick on. No tick may be in flight.
  virtual void setCloths(std::span<const model::Cloth>) {}

  // Uploads what the tick needs, and clears what it counts. A barrier is before and after it.
  virtual void recordInputs(vulkan::Recorder&, const Tick&) {}
  // Works on the tick's start, which is in the state buffers `present`. Begins with a barrier.
  virtual void recordStart(vulkan::Recorder&, const Tick&, std::uint32_t /*present*/) {}
  // Begins with a barrier.
  virtual void recordSubstep(vulkan::Recorder&, const Substep&) {}
  // Measures the tick's end, which is in the state buffers `present`. `collision` is the push of the last
  // substep. A barrier is before and after it.
  virtual void recordEnd(vulkan::Recorder&, const Tick&, std::uint32_t /*present*/,
                         const shared::CollisionPush& /*collision*/) {}
  // Copies what was measured to the CPU. A barrier is before it.
  virtual void recordReport(vulkan::Recorder&, const Tick&) {}

 protected:
  // The tables changed: uploadTables() has to upload them again.
  void outdate() { outdated_ = true; }

 private:
  virtual void recordTables(vulkan::Recorder&) {}

  bool outdated_ = true;
};

}  // namespace clothstream::simulation
