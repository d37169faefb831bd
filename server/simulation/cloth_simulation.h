// SPDX-License-Identifier: MIT
// All cloths of one scene on one Vulkan device: the mass-spring pipeline of [Va21].
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/cloth_report.h"
#include "server/simulation/collision/moving_collider.h"
#include "server/simulation/attachment/grab.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/state_snapshot.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Model (immutable: sizes, springs, pins) apart from state (positions, velocities). All cloths share one set
// of buffers; a stage is one dispatch for all of them. Belongs to the device's thread; records, never submits
// or waits. Every record...() begins with a barrier: it sees what came before it, in its recording and in
// earlier ones.
//
// A tick:   recordTick -> (submit, wait) -> status
// Same inputs give the same bits, on every conforming device, whatever the options.

// What may change from tick to tick. All values validated before.
struct TickInputs {
  model::Environment environment;
  std::vector<MovingCollider> colliders;  // at most kMaxColliders, in the order in which they act
  bool reportsContacts = false;             // whether contacts() has something to say after this tick
  // Where each attachment of the scene is at the tick's end, in the order of its cloths; none: where they
  // start.
  std::vector<model::Pose> attachments = {};
  // At most kMaxGrabs. One that holds has the place of the one that took hold; before a place is another's,
  // it is free for a tick.
  std::vector<Grab> grabs = {};
};

// Of the scene by itself: its wind, its colliders and what is attached to them during this tick, from 0 on.
TickInputs inputsAt(const model::Scene& scene, std::uint64_t tick);

struct SimulationOptions {
  // Rows of a grid that one invocation walks down. 0: the measured best for the device (more on software
  // devices).
  std::uint32_t rowsPerInvocation = 0;
  // Invocations in a workgroup. 0: the measured best for the device.
  std::uint32_t workgroupSize = 0;
  // Nodes of the largest cloth whose springs one workgroup corrects, where its solver is xpbd. Absent: the
  // measured best for the device.
  std::optional<std::uint32_t> xpbdWholeNodes = {};
  // Nodes of the largest cloth whose linear system one workgroup solves. Absent: likewise.
  std::optional<std::uint32_t> solveWholeNodes = {};
  // Another build of the kernel advance_mass_spring, for comparisons; empty: the one that belongs here.
  std::span<const std::uint32_t> advanceKernel = {};
};

class ClothSimulation {
 public:
  // The scene must be valid (messages/validate). Throws std::runtime_error where the device has no room for
  // it.
  ClothSimulation(const vulkan::Device& device, const model::Scene& scene, SimulationOptions options = {});
  ~ClothSimulation();
  ClothSimulation(const ClothSimulation&) = delete;
  ClothSimulation& operator=(const ClothSimulation&) = delete;

  // Parameters of cloths from the next recorded tick on. Same cloths, same shapes, same pins and attachments
  // as at construction, self-collision and tethers of the same cloths; the state stays. No tick may be in
  // flight. Throws std::runtime_error where the device has no room for what is asked for, and changes nothing
  // then. Kernels are made when a cloth first needs them, and kept.
  void setCloths(std::span<const model::Cloth> cloths);

  // All substeps of one tick, and its status. At most one tick may be in flight when it is called.
  // Stages: "inputs", "hold" (where something holds cloth), "near" (where there are colliders), "advance",
  // "hash".
  void recordTick(vulkan::Recorder& recorder, const TickInputs& inputs);

  // Vertex normals of the present positions ([Va21] 3.5, Alg. 5; of meshes from their triangles). Only when
  // somebody needs them. Stage "normals".
  void recordNormals(vulkan::Recorder& recorder);

  // Of the last recorded tick, once it is complete.
  TickStatus status() const;
  // Of its last substep: one a cloth that a linear system is solved for; first constraints, then implicit
  // Euler, each first of grids and first of small ones; then those whose systems are assembled.
  std::vector<shared::SolveRecord> solves() const;

  // Of the last recorded tick, once it is complete: by colliders, then by cloths. Colliders that did nothing
  // have none.
  std::vector<ContactStatus> contacts() const;

  // Of the last recorded tick's grabs, once it is complete.
  std::vector<GrabStatus> grabs() const;

  // What the cloths are like, each of them: recorded after a tick in the same recording, and read when that
  // is complete. Only when somebody wants it: other ticks cost nothing. Stage "report".
  void recordReport(vulkan::Recorder& recorder, const TickInputs& inputs);
  std::vector<ClothReport> report() const;

  // Keeps the present state on the device; goes back to what was kept last (the start, if nothing was).
  // Stage "checkpoint".
  void recordCheckpoint(vulkan::Recorder& recorder);
  void recordRollback(vulkan::Recorder& recorder);

  // The state to the CPU: record, submit and wait, collect. Stage "state".
  void recordSaveState(vulkan::Recorder& recorder);
  StateSnapshot collectState(std::uint64_t tick) const;
  // The state from the CPU; also becomes the checkpoint. An earlier restore, and the first recording of all,
  // must be complete. Throws std::invalid_argument on a snapshot of another scene's size. Stage "state".
  void recordRestoreState(vulkan::Recorder& recorder, const StateSnapshot& snapshot);

  std::uint32_t nodeCount() const;
  // First node of each cloth, and at the end nodeCount(): clothCount + 1 numbers.
  std::span<const std::uint32_t> clothOffsets() const;

  // What other stages read: RGBA32F texels, xyz = position, w = inverse mass (0 for pinned nodes); and
  // normals, vec4 a node, w = 0. Positions lie in two buffers in turn: stages bind both ahead and choose by
  // presentIndex(), as it stands when they record. They begin with a barrier of their own.
  const vulkan::Buffer& positions(std::uint32_t index) const;  // 0 or 1
  std::uint32_t presentIndex() const;
  const vulkan::Buffer& normals() const;

 private:
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace clothstream::simulation
