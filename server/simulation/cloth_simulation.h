// SPDX-License-Identifier: MIT
// All cloths of one scene on one Vulkan device: the mass-spring pipeline of [Va21].
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "server/scene/scene.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Model (immutable: sizes, springs, pins) apart from state (positions, velocities). All cloths share one set of
// buffers; a stage is one dispatch for all of them. Belongs to the device's thread; records, never submits or waits.
//
// A tick:   recordTick -> (submit, wait) -> status
// Same inputs give the same bits, on every conforming device.

// A sphere as the tick sees it: it moves in a straight line from start to end over the tick's substeps.
struct MovingSphere {
  scene::Vec3 start = scene::Vec3::Zero();
  scene::Vec3 end = scene::Vec3::Zero();
  float radius = 0;    // m
  float friction = 1;  // Coulomb; multiplied with the cloth's
};

// What may change from tick to tick. All values validated before.
struct TickInputs {
  scene::Environment environment;
  std::vector<MovingSphere> spheres;  // at most kMaxSpheres
};
inline constexpr std::size_t kMaxSpheres = 4096;

struct TickStatus {
  std::uint64_t stateHash = 0;  // of positions and velocities, bits
  bool healthy = true;          // all finite and within kWorldExtent of the origin
};
inline constexpr float kWorldExtent = 8192;  // m

// Positions and velocities, exact to the bit. Good for another ClothSimulation of the same scene on any device.
struct StateSnapshot {
  std::uint64_t tick = 0;  // the caller's
  std::vector<std::byte> bytes;
};

struct SimulationOptions {
  // Rows of a grid that one invocation walks down. 0: the measured best for the device (more on software devices).
  std::uint32_t rowsPerInvocation = 0;
};

class ClothSimulation {
 public:
  // The scene must be valid (messages/validate). Throws std::runtime_error where the device has no room for it.
  ClothSimulation(const vulkan::Device& device, const scene::Scene& scene, SimulationOptions options = {});
  ~ClothSimulation();
  ClothSimulation(const ClothSimulation&) = delete;
  ClothSimulation& operator=(const ClothSimulation&) = delete;

  // Parameters of cloths (springs, damping, drag, lift, friction) from the next recorded tick on. Same cloths, same
  // grids, same pins as at construction.
  void setCloths(std::span<const scene::Cloth> cloths);

  // All substeps of one tick, and its status. At most one tick may be in flight.
  void recordTick(vulkan::Recorder& recorder, const TickInputs& inputs);

  // Vertex normals of the present positions ([Va21] 3.5, Alg. 5). Only when somebody needs them.
  void recordNormals(vulkan::Recorder& recorder);

  // Of the last tick, once it is complete.
  TickStatus status() const;

  // Keeps the present state on the device; goes back to what was kept last (the start, if nothing was).
  void recordCheckpoint(vulkan::Recorder& recorder);
  void recordRollback(vulkan::Recorder& recorder);

  // The state to the CPU: record, submit and wait, collect.
  void recordSaveState(vulkan::Recorder& recorder);
  StateSnapshot collectState(std::uint64_t tick) const;
  // The state from the CPU; also becomes the checkpoint. Throws std::invalid_argument on a snapshot of another
  // scene's size.
  void recordRestoreState(vulkan::Recorder& recorder, const StateSnapshot& snapshot);

  std::uint32_t nodeCount() const;
  // First node of each cloth, and at the end nodeCount(): clothCount + 1 numbers.
  std::span<const std::uint32_t> clothOffsets() const;

  // What other stages read: RGBA32F texels, xyz = position, w = inverse mass (0 for pinned nodes); and normals,
  // vec4 a node, w = 0. Positions lie in two buffers in turn: stages bind both ahead and choose by presentIndex(),
  // as it stands when they record.
  const vulkan::Buffer& positions(std::uint32_t index) const;  // 0 or 1
  std::uint32_t presentIndex() const;
  const vulkan::Buffer& normals() const;

 private:
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

// StateSnapshot <-> numbers, for tests and checkpoints: 3 floats a node each.
struct NodeState {
  std::vector<scene::Vec3> positions, velocities;
};
NodeState unpack(const StateSnapshot& snapshot);
StateSnapshot pack(const NodeState& state, std::span<const float> inverseMasses, std::uint64_t tick);

}  // namespace clothstream::simulation
