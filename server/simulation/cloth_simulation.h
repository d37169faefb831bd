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
#include "server/simulation/scene_tables.h"
#include "server/simulation/stage_plan.h"
#include "server/simulation/state_snapshot.h"
#include "server/simulation/tick_inputs.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

class SurfaceStage;

// All cloths of a scene on one device. The model (sizes, springs, pins) is immutable; the state (positions,
// velocities) changes. All cloths share one set of buffers, and a stage is one dispatch for all of them.
// Belongs to the device's thread. It records work, but never submits or waits. Every record...() begins with
// a barrier, so that it sees earlier work of its recording and of earlier recordings.
//
// A tick:   recordTick -> (submit, wait) -> status
// The same inputs give the same bits on every conforming device and with all options.

struct SimulationOptions {
  // Rows of a grid that one invocation walks down. 0: as the device's vulkan::KernelSettings have it (fewer
  // for GPUs).
  std::uint32_t rowsPerInvocation = 0;
  // Invocations in a workgroup. 0: the measured best for the device.
  std::uint32_t workgroupSize = 0;
  // Nodes of the largest cloth with solver xpbd that one workgroup corrects. Absent: the measured best for
  // the device.
  std::optional<std::uint32_t> xpbdWholeNodes = {};
  // Nodes of the largest cloth whose linear system one workgroup solves. Absent: the measured best for the
  // device.
  std::optional<std::uint32_t> solveWholeNodes = {};
  // Another build of the kernel advance_mass_spring, for comparisons; it outlives the simulation. Null: the
  // regular one.
  const vulkan::KernelCode* advanceKernel = nullptr;
};

class ClothSimulation {
 public:
  // The scene must be valid (server/messages). Throws std::runtime_error if the device has too little
  // memory.
  ClothSimulation(const vulkan::Device& device, const model::Scene& scene, SimulationOptions options = {});
  ~ClothSimulation();
  ClothSimulation(const ClothSimulation&) = delete;
  ClothSimulation& operator=(const ClothSimulation&) = delete;

  // Sets the parameters of the cloths from the next recorded tick on. Shapes, pins and attachments must be
  // those of construction, and the same cloths must have self-collision and tethers. The state stays. No tick
  // may be in flight. Throws std::runtime_error and changes nothing if the device has too little memory.
  // Kernels are created when a cloth first needs them and are kept, and so are the stages of the newest
  // combinations of solvers (KeptStages).
  void setCloths(std::span<const model::Cloth> cloths);
  // Returns whether setCloths() would make stages, which takes milliseconds to seconds.
  bool makesStages(std::span<const model::Cloth> cloths) const;
  // Returns what setCloths() would make.
  StagePlan planStages(std::span<const model::Cloth> cloths) const;
  // Makes that. Another thread may call it, also while this simulation works. Throws std::runtime_error if
  // the device has too little memory.
  std::shared_ptr<NewStages> makeStages(const StagePlan& plan);
  // The next setCloths() uses these stages, as far as its cloths need them.
  void takeStages(std::shared_ptr<NewStages> stages);
  // Number of times that setCloths() has made stages.
  std::uint64_t stagesMade() const;

  // Sets the number of substeps from the next recorded tick on, at least 1; it is initially that of the
  // scene. `cloths` are the present ones. The motion has the same bits as that of a simulation that was
  // constructed with this number. No tick may be in flight.
  void setSubsteps(std::uint32_t substeps, std::span<const model::Cloth> cloths);

  // Records all substeps of one tick, and its status. At most one tick may be in flight at the call. Stages:
  // "inputs", "attachments" (if cloth is attached, grabbed or follows joints), "skins" (if a collider has
  // joints), "near" (if there are colliders), "advance", "hash".
  void recordTick(vulkan::Recorder& recorder, const TickInputs& inputs);

  // Returns whether the simulation has the stage that surfaces of the real room need.
  bool hasSurfaces() const;
  // Makes that stage: buffers and a kernel. Another thread may call it, also while this simulation works.
  // Throws std::runtime_error if the device has too little memory.
  std::shared_ptr<SurfaceStage> makeSurfaces() const;
  // Uses the stage from the next recorded tick on. A tick with surfaces otherwise makes one itself, which on
  // a software device takes tenths of a second.
  void takeSurfaces(std::shared_ptr<SurfaceStage> stage);
  // Texels of the surface that the next recorded tick has to upload if it has this surface. A tick uploads
  // kSurfaceUploadTexels without being late.
  std::size_t texelsToUpload(const SurfaceTable& table) const;

  // Records the vertex normals of the present positions ([Va21] 3.5, Alg. 5; of meshes from their triangles).
  // Call it only if normals are needed. Stage "normals".
  void recordNormals(vulkan::Recorder& recorder);

  // Status of the last recorded tick, once it is complete.
  TickStatus status() const;
  // Records of the solves of its last substep, one per cloth with a linear system. The order is: constraints,
  // then implicit Euler (each first grids, then meshes, and small systems first), then assembled systems.
  std::vector<shared::SolveRecord> solves() const;

  // The following three replace the elements of a vector, so that a tick allocates nothing.
  //
  // Contacts of the last recorded tick, once it is complete, ordered by collider, then by cloth. Colliders
  // without contact are left out.
  void readContacts(std::vector<ContactStatus>& contacts) const;
  // For each collider: depth of the deepest free node that touches it, in this or another collider, at the
  // end of the last recorded tick, once it is complete. Only nodes of cloths that nothing passes through
  // count. Metres, in the order of TickInputs::colliders; 0 for a triangle mesh. Empty if the scene has no
  // such cloth.
  void readDepths(std::vector<float>& depths) const;
  // Status of the grabs of the last recorded tick, once it is complete.
  void readGrabs(std::vector<GrabStatus>& grabs) const;

  // Records a report of each cloth after a tick, in the same recording. report() reads it once that is
  // complete. Ticks without a report cost nothing. Stage "report".
  void recordReport(vulkan::Recorder& recorder, const TickInputs& inputs);
  std::vector<ClothReport> report() const;
  // Ends of the active constraints of each cloth with ACAD in the last solve of the tick, two nodes of the
  // cloth for each spring. At most kMostNamedConstraints springs, the first cloth's first. Empty if the
  // recorded report should not name them.
  std::vector<std::vector<std::uint32_t>> constraintEnds() const;

  // Keeps the present state on the device, or returns to the state that was kept last (initially the start).
  // Stage "checkpoint".
  void recordCheckpoint(vulkan::Recorder& recorder);
  void recordRollback(vulkan::Recorder& recorder);

  // Copies the state to the CPU, with the nodes that grabs hold: record, submit and wait, collect. Stage
  // "state".
  void recordSaveState(vulkan::Recorder& recorder);
  StateSnapshot collectState(std::uint64_t tick) const;
  // Sets positions and velocities from the CPU; they also become the checkpoint. Grabs keep the nodes that
  // they hold. An earlier restore, and the first recording of all, must be complete. Throws
  // std::invalid_argument if the snapshot has the size of another scene. Stage "state".
  void recordRestoreState(vulkan::Recorder& recorder, const StateSnapshot& snapshot);
  // Sets the nodes that grabs hold. The next tick must have these grabs in the state `holds`. No earlier
  // recording may be in flight. Throws std::invalid_argument if a node or a grab does not exist, and
  // std::runtime_error if the device has too little memory. Stage "state".
  void recordRestoreGrabs(vulkan::Recorder& recorder, const HeldNodes& held);

  // The point to which positions on the device are relative, in the world: model::originOf() of the scene.
  // Inputs and results of this class are in the world, except for snapshots.
  const model::Vec3& origin() const;
  std::uint32_t nodeCount() const;
  // First node of each cloth, then nodeCount(): clothCount + 1 numbers.
  std::span<const std::uint32_t> clothOffsets() const;

  // Buffers that other stages read. Positions are RGBA32F texels: xyz = position relative to origin(), w =
  // inverse mass (0 for pinned nodes). Normals are one vec4 per node with w = 0. Positions alternate between
  // two buffers. Other stages bind both and choose by presentIndex() when they record; they begin with their
  // own barrier.
  const vulkan::Buffer& positions(std::uint32_t index) const;  // 0 or 1
  std::uint32_t presentIndex() const;
  const vulkan::Buffer& normals() const;

 private:
  struct Pipeline;
  std::unique_ptr<Pipeline> pipeline_;
};

}  // namespace clothstream::simulation
