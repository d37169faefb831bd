// SPDX-License-Identifier: MIT
// All cloths of one scene on one Vulkan device: the mass-spring pipeline of [Va21].
#include "server/simulation/cloth_simulation.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <iterator>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "server/model/origin.h"
#include "server/simulation/attachment/attachment_stage.h"
#include "server/simulation/cloth_skin/cloth_skin_stage.h"
#include "server/simulation/cloth_skin/skin_limit_stage.h"
#include "server/simulation/coarse/coarse_stage.h"
#include "server/simulation/collision/collision_stage.h"
#include "server/simulation/collision/skin_stage.h"
#include "server/simulation/collision/solid_stage.h"
#include "server/simulation/collision/surface_stage.h"
#include "server/simulation/force_stage.h"
#include "server/simulation/gas/gas_stage.h"
#include "server/simulation/hash_stage.h"
#include "server/simulation/mass_stage.h"
#include "server/simulation/motion_bound/motion_bound_stage.h"
#include "server/simulation/report_stage.h"
#include "server/simulation/self_collision/self_collision_stage.h"
#include "server/simulation/solvers.h"
#include "server/simulation/stage.h"
#include "server/simulation/state_memory.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

std::uint32_t workgroupSizeOn(const vulkan::Device& device, const SimulationOptions& options) {
  const std::uint32_t wanted = options.workgroupSize == 0 ? 64 : options.workgroupSize;
  return std::min(wanted, device.limits().maxWorkgroupInvocations);
}

std::vector<Follow> followsOf(std::span<const model::Cloth> cloths) {
  std::vector<Follow> follows;
  for (const model::Cloth& cloth : cloths) follows.push_back(followOf(cloth));
  return follows;
}

// State and parameters of a scene on the device. The parameters have two uploads, because a tick may be in
// flight while the next one is recorded.
struct Memory {
  Memory(const vulkan::Device& device, const model::Scene& scene, std::uint32_t nodes, std::size_t clothCount)
      : state(device, nodes, GasStage::isIn(scene) ? static_cast<std::uint32_t>(clothCount) : 0),
        normals(device, BufferPurpose::texels, nodes * kTexelBytes),
        cloths(device, BufferPurpose::texels, clothCount * sizeof(shared::ClothRecord)),
        stretches(device, BufferPurpose::indirect,
                  (kFirstMark + std::size_t{nodes}) * sizeof(std::uint32_t)) {
    for (Buffer& buffer : uploads) buffer = Buffer(device, BufferPurpose::upload, cloths.bytes());
  }

  StateMemory state;
  Buffer normals, cloths;
  Buffer stretches;  // StateBuffers::stretches
  std::array<Buffer, 2> uploads;
};

StateBuffers stateOf(const Memory& memory, const CollisionStage& collision) {
  return {.cloths = memory.cloths,
          .colliders = collision.colliders(),
          .nearColliders = collision.nearLists(),
          .contactImpulses = collision.contactImpulses(),
          .stretches = memory.stretches,
          .positions = {&memory.state.positions[0], &memory.state.positions[1]},
          .velocities = {&memory.state.velocities[0], &memory.state.velocities[1]}};
}

// The stages of a scene. list() has their order; a stage that it leaves out does nothing.
struct Stages {
  Stages(const vulkan::Device& device, const model::Scene& scene, const Memory& memory,
         std::span<const std::uint32_t> clothOffsets, const SimulationOptions& options,
         std::uint32_t workgroupSize)
      : solidTables(simulation::solidTables(scene.colliders)),
        collision(device, solidTables, clothOffsets.back(), static_cast<std::uint32_t>(scene.cloths.size()),
                  {&memory.state.positions[0], &memory.state.positions[1]},
                  {&memory.state.velocities[0], &memory.state.velocities[1]}),
        solvers(device, stateOf(memory, collision), scene.cloths,
                {.workgroup = workgroupSize,
                 .askedWorkgroup = options.workgroupSize,
                 .xpbdWholeNodes = options.xpbdWholeNodes,
                 .solveWholeNodes = options.solveWholeNodes}),
        forces(device, scene, stateOf(memory, collision), memory.normals,
               {.rowsPerInvocation = options.rowsPerInvocation,
                .workgroupSize = workgroupSize,
                .advanceKernel = options.advanceKernel},
               solvers.solves()),
        masses(device, scene.cloths, memory.state),
        hash(device, stateOf(memory, collision), clothOffsets.back(), model::originOf(scene),
             model::reachOf(scene.stream), workgroupSize) {
    const StateBuffers state = stateOf(memory, collision);
    if (CoarseStage::isIn(scene.cloths))
      coarse = std::make_unique<CoarseStage>(device, scene.cloths, state, workgroupSize);
    if (GasStage::isIn(scene))
      gas = std::make_unique<GasStage>(device, scene, state, memory.state.gas, workgroupSize);
    if (SelfCollisionStage::isIn(scene))
      selfCollision = std::make_unique<SelfCollisionStage>(device, scene, state, workgroupSize);
    if (!solidTables.empty())
      solids = std::make_unique<SolidStage>(device, solidTables, scene.cloths, state, workgroupSize);
    if (SkinTables tables = skinTables(solidTables); !tables.empty())
      skins = std::make_unique<SkinStage>(device, std::move(tables), solidTables, solids->solids(),
                                          workgroupSize);
    if (ClothSkinTables tables = clothSkinTables(scene, model::originOf(scene)); !tables.empty()) {
      clothSkins = std::make_unique<ClothSkinStage>(device, std::move(tables), state, workgroupSize);
      if (clothSkins->limitCount() > 0)
        skinLimits = std::make_unique<SkinLimitStage>(device, *clothSkins, state, workgroupSize);
    }
    if (MotionBoundStage::isIn(scene))
      motionBound = std::make_unique<MotionBoundStage>(device, scene, state, workgroupSize);
    if (const AttachmentTables tables = attachmentTables(scene, model::originOf(scene)); !tables.empty()) {
      attachments = std::make_unique<AttachmentStage>(device, tables, state, clothOffsets, workgroupSize);
      attachments->setCloths(scene.cloths);
    }
  }

  // In their order. Gas knows the free motion that springs give as forces, and solvers hold their springs
  // against it. Attachments and joints carry nodes before CollisionStage lists the colliders near them, and
  // joints move before it reads the reach of their meshes.
  std::vector<Stage*> list() {
    std::vector<Stage*> all{coarse.get(), solvers.bending(), &forces, gas.get()};
    std::ranges::copy(solvers.afterForces(), std::back_inserter(all));
    all.insert(all.end(),
               {attachments.get(), clothSkins.get(), selfCollision.get(), skins.get(), solids.get(),
                surfaces.get(), skinLimits.get(), &collision, motionBound.get(), &masses, &hash});
    std::erase(all, nullptr);
    return all;
  }

  SolidTables solidTables;
  CollisionStage collision;
  Solvers solvers;
  ForceStage forces;
  MassStage masses;
  HashStage hash;
  std::unique_ptr<CoarseStage> coarse;                // null if no cloth uses it
  std::unique_ptr<GasStage> gas;                      // null if no cloth can hold gas
  std::unique_ptr<SelfCollisionStage> selfCollision;  // null if no cloth uses it
  std::unique_ptr<SolidStage> solids;                 // null if no collider is a triangle mesh
  std::unique_ptr<SkinStage> skins;                   // null if no mesh has joints
  std::unique_ptr<ClothSkinStage> clothSkins;         // null if no cloth follows joints
  std::unique_ptr<SkinLimitStage> skinLimits;         // null if no node has limits
  std::shared_ptr<SurfaceStage> surfaces;             // null until the first surface of the real room
  std::unique_ptr<MotionBoundStage> motionBound;      // null if no cloth uses it
  std::unique_ptr<AttachmentStage> attachments;       // created when it is first needed
};

}  // namespace

struct ClothSimulation::Pipeline {
  Pipeline(const vulkan::Device& on, const model::Scene& scene, const SimulationOptions& options);

  // Grabs may begin in a scene without attachments.
  void makeAttachments();
  // Call it when a stage was made or replaced.
  void listStages() { order = stages.list(); }
  // Creates the kernels that the present cloths need, and those that they need as soon as a collider appears.
  void prepare();
  // Inputs relative to the origin.
  const TickInputs& nearby(const TickInputs& inputs);
  // Records what must be on the device before other work.
  void start(vulkan::Recorder& recorder);
  void recordInputs(vulkan::Recorder& recorder, const Tick& tick);
  void recordSubsteps(vulkan::Recorder& recorder, const Tick& tick);
  void recordEnd(vulkan::Recorder& recorder, const Tick& tick);
  // Push of the last substep.
  shared::CollisionPush lastPush() const {
    return stages.collision.push(substeps - 1, substeps, static_cast<float>(simulationRate));
  }

  const vulkan::Device& device;
  const SimulationOptions asked;
  const std::uint32_t workgroupSize;
  const std::uint32_t simulationRate;  // ticks/s
  const model::Vec3 origin;
  const std::vector<std::uint32_t> offsets;  // of the cloths
  std::uint32_t substeps;
  double substepSeconds;
  std::vector<shared::ClothRecord> records;
  std::vector<SpringStiffness> stiffness;  // of the cloths' springs
  std::vector<Follow> follows;             // of the cloths' forces
  Memory memory;
  Stages stages;
  std::vector<Stage*> order;            // of the stages
  std::unique_ptr<ReportStage> report;  // created for the first report
  TickInputs moved;                     // by nearby(), of scenes with an origin elsewhere

  bool started = false;           // the start state is on the device
  bool namesConstraints = false;  // the last recorded report does
  std::uint32_t present = 0;      // index of the state buffers with the present state
  std::uint32_t slot = 0;         // Tick::slot of the last recorded tick
};

ClothSimulation::Pipeline::Pipeline(const vulkan::Device& on, const model::Scene& scene,
                                    const SimulationOptions& options)
    : device(on),
      asked(options),
      workgroupSize(workgroupSizeOn(on, options)),
      simulationRate(scene.simulationRate),
      origin(model::originOf(scene)),
      offsets(simulation::clothOffsets(scene.cloths)),
      substeps(scene.substeps),
      substepSeconds(scene.substepSeconds()),
      records(clothRecords(scene.cloths, substepSeconds)),
      stiffness(springStiffness(scene.cloths)),
      follows(followsOf(scene.cloths)),
      memory(on, scene, offsets.back(), records.size()),
      stages(on, scene, memory, offsets, options, workgroupSize) {
  std::memcpy(memory.uploads[slot].mapped().data(), records.data(), memory.cloths.bytes());
  memory.state.write(startState(scene, origin), stages.masses.inverseMasses());
  listStages();
  prepare();
}

void ClothSimulation::Pipeline::makeAttachments() {
  if (stages.attachments) return;
  stages.attachments = std::make_unique<AttachmentStage>(
      device, AttachmentTables{}, stateOf(memory, stages.collision), offsets, workgroupSize);
  listStages();
}

void ClothSimulation::Pipeline::prepare() {
  stages.forces.prepare(records);
  stages.solvers.prepare(records);
}

const TickInputs& ClothSimulation::Pipeline::nearby(const TickInputs& inputs) {
  if (origin.isZero(0)) return inputs;
  moved = inputs;
  for (MovingCollider& collider : moved.colliders)
    for (model::Pose* pose : {&collider.start, &collider.end, &collider.before}) pose->position -= origin;
  for (model::LocalWind& wind : moved.winds) wind.pose.position -= origin;
  for (model::Pose& pose : moved.attachments) pose.position -= origin;
  for (model::Carry& carry : moved.carries)
    for (model::Pose* pose : {&carry.from, &carry.to}) pose->position -= origin;
  for (Grab& grab : moved.grabs)
    for (model::Pose* pose : {&grab.start, &grab.end}) pose->position -= origin;
  for (PlacedSurface& surface : moved.surfaces) surface.pose.position -= origin;
  return moved;
}

void ClothSimulation::Pipeline::start(vulkan::Recorder& recorder) {
  recorder.barrier();
  if (!std::exchange(started, true)) {
    recorder.copy(memory.uploads[slot], memory.cloths, memory.cloths.bytes());
    memory.state.recordUpload(recorder, present);
    recorder.barrier();
  }
  if (std::ranges::none_of(order, &Stage::isOutdated)) return;
  for (Stage* stage : order) stage->uploadTables(recorder);
  recorder.barrier();
}

void ClothSimulation::Pipeline::recordInputs(vulkan::Recorder& recorder, const Tick& tick) {
  const Buffer& upload = memory.uploads[tick.slot];
  std::memcpy(upload.mapped().data(), records.data(), upload.bytes());
  recorder.beginStage("inputs");
  recorder.copy(upload, memory.cloths, upload.bytes());
  for (Stage* stage : order) stage->recordInputs(recorder, tick);
}

void ClothSimulation::Pipeline::recordSubsteps(vulkan::Recorder& recorder, const Tick& tick) {
  for (Stage* stage : order) stage->recordStart(recorder, tick, present);
  recorder.beginStage("advance");
  for (std::uint32_t index = 0; index < substeps; ++index) {
    const Substep substep{.tick = tick,
                          .index = index,
                          .from = present,
                          .collision = stages.collision.push(index, substeps, tick.rate),
                          .solids = stages.collision.solidCount()};
    for (Stage* stage : order) stage->recordSubstep(recorder, substep);
    present = 1 - present;
  }
}

void ClothSimulation::Pipeline::recordEnd(vulkan::Recorder& recorder, const Tick& tick) {
  recorder.beginStage("hash");
  recorder.barrier();
  const shared::CollisionPush push = lastPush();
  for (Stage* stage : order) stage->recordEnd(recorder, tick, present, push);
  recorder.barrier();
  for (Stage* stage : order) stage->recordReport(recorder, tick);
}

ClothSimulation::ClothSimulation(const vulkan::Device& device, const model::Scene& scene,
                                 SimulationOptions options)
    : pipeline_(std::make_unique<Pipeline>(device, scene, options)) {}

ClothSimulation::~ClothSimulation() = default;

void ClothSimulation::setCloths(std::span<const model::Cloth> cloths) {
  Pipeline& on = *pipeline_;
  std::vector<shared::ClothRecord> records = clothRecords(cloths, on.substepSeconds);
  assert(records.size() == on.records.size());
  assert(std::equal(records.begin(), records.end(), on.records.begin(),
                    [](const shared::ClothRecord& a, const shared::ClothRecord& b) {
                      return a.rows == b.rows && a.columns == b.columns;
                    }));
  on.stages.masses.prepare(cloths);
  bool divides = on.stages.solvers.set(cloths);
  on.listStages();
  if (std::vector<Follow> follows = followsOf(cloths); follows != on.follows) {
    on.follows = std::move(follows);
    divides = true;
  }
  if (divides) on.stages.forces.setTiles(cloths);
  for (Stage* stage : on.order) stage->setCloths(cloths);
  on.stiffness = springStiffness(cloths);
  on.records = std::move(records);
  on.prepare();
}

bool ClothSimulation::makesStages(std::span<const model::Cloth> cloths) const {
  return pipeline_->stages.solvers.needs(cloths);
}

StagePlan ClothSimulation::planStages(std::span<const model::Cloth> cloths) const {
  return pipeline_->stages.solvers.plan(cloths);
}

std::shared_ptr<NewStages> ClothSimulation::makeStages(const StagePlan& plan) {
  return pipeline_->stages.solvers.make(plan);
}

void ClothSimulation::takeStages(std::shared_ptr<NewStages> stages) {
  pipeline_->stages.solvers.take(std::move(stages));
}

std::uint64_t ClothSimulation::stagesMade() const {
  return pipeline_->stages.solvers.made();
}

void ClothSimulation::setSubsteps(std::uint32_t substeps, std::span<const model::Cloth> cloths) {
  Pipeline& on = *pipeline_;
  on.substeps = substeps;
  on.substepSeconds = 1.0 / on.simulationRate / substeps;
  on.records = clothRecords(cloths, on.substepSeconds);
}

void ClothSimulation::recordTick(vulkan::Recorder& recorder, const TickInputs& inWorld) {
  Pipeline& on = *pipeline_;
  assert(inWorld.colliders.size() <= kMaxColliders);
  if (!inWorld.grabs.empty()) on.makeAttachments();
  if (!hasSurfaces() && !(inWorld.surfaces.empty() && inWorld.arriving.empty())) takeSurfaces(makeSurfaces());
  on.start(recorder);
  on.slot = 1 - on.slot;
  const Tick tick{.inputs = on.nearby(inWorld),
                  .cloths = on.records,
                  .substeps = on.substeps,
                  .substepSeconds = on.substepSeconds,
                  .rate = static_cast<float>(on.simulationRate),
                  .slot = on.slot};
  on.recordInputs(recorder, tick);
  on.recordSubsteps(recorder, tick);
  on.recordEnd(recorder, tick);
}

bool ClothSimulation::hasSurfaces() const {
  return pipeline_->stages.surfaces != nullptr;
}

std::shared_ptr<SurfaceStage> ClothSimulation::makeSurfaces() const {
  const Pipeline& on = *pipeline_;
  return std::make_shared<SurfaceStage>(on.device, on.offsets, stateOf(on.memory, on.stages.collision),
                                        on.workgroupSize);
}

void ClothSimulation::takeSurfaces(std::shared_ptr<SurfaceStage> stage) {
  pipeline_->stages.surfaces = std::move(stage);
  pipeline_->listStages();
}

std::size_t ClothSimulation::texelsToUpload(const SurfaceTable& table) const {
  const SurfaceStage* const stage = pipeline_->stages.surfaces.get();
  return stage == nullptr ? surfaceTexels(table) : stage->texelsToUpload(table);
}

void ClothSimulation::recordNormals(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("normals");
  pipeline_->stages.forces.recordNormals(recorder, pipeline_->present);
}

void ClothSimulation::recordReport(vulkan::Recorder& recorder, const TickInputs& inputs) {
  Pipeline& on = *pipeline_;
  if (!on.report)
    on.report = std::make_unique<ReportStage>(on.device, on.records, stateOf(on.memory, on.stages.collision),
                                              on.stages.forces.springs(), on.stages.solids.get(),
                                              on.asked.workgroupSize);
  recorder.beginStage("report");
  on.report->record(recorder, on.present, on.stiffness, inputs.environment.gravity, on.origin, on.lastPush(),
                    on.stages.collision.solidCount());
  on.namesConstraints = inputs.namesConstraints && on.stages.solvers.recordActiveSprings(recorder);
}

void ClothSimulation::readContacts(std::vector<ContactStatus>& contacts) const {
  pipeline_->stages.collision.readContacts(pipeline_->slot, contacts);
}

void ClothSimulation::readDepths(std::vector<float>& depths) const {
  const Stages& stages = pipeline_->stages;
  depths.clear();
  if (stages.motionBound) stages.collision.order(stages.motionBound->depths(pipeline_->slot), depths);
}

void ClothSimulation::readGrabs(std::vector<GrabStatus>& grabs) const {
  grabs.clear();
  if (!pipeline_->stages.attachments) return;
  for (const shared::GrabReport& report : pipeline_->stages.attachments->report(pipeline_->slot))
    grabs.push_back(statusOf(report));
}

std::vector<ClothReport> ClothSimulation::report() const {
  assert(pipeline_->report);
  std::vector<ClothReport> reports = pipeline_->report->collect();
  pipeline_->stages.solvers.addTo(reports);
  return reports;
}

std::vector<std::vector<std::uint32_t>> ClothSimulation::constraintEnds() const {
  std::vector<std::vector<std::uint32_t>> ends(pipeline_->records.size());
  if (pipeline_->namesConstraints)
    pipeline_->stages.solvers.solves().activeSprings(kMostNamedConstraints, ends);
  return ends;
}

TickStatus ClothSimulation::status() const {
  const Stages& stages = pipeline_->stages;
  TickStatus status = stages.hash.status(pipeline_->slot);
  if (stages.selfCollision) {
    const shared::CrowdReport& report = stages.selfCollision->report(pipeline_->slot);
    status.crowded = report.lists + report.balls;
  }
  if (stages.motionBound) status.crowded += stages.motionBound->report(pipeline_->slot).overflows;
  return status;
}

void ClothSimulation::recordCheckpoint(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("checkpoint");
  pipeline_->memory.state.recordCheckpoint(recorder, pipeline_->present);
}

void ClothSimulation::recordRollback(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("checkpoint");
  pipeline_->memory.state.recordRollback(recorder, pipeline_->present);
}

void ClothSimulation::recordSaveState(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("state");
  pipeline_->memory.state.recordSave(recorder, pipeline_->present);
  if (pipeline_->stages.attachments) pipeline_->stages.attachments->recordSave(recorder);
}

StateSnapshot ClothSimulation::collectState(std::uint64_t tick) const {
  StateSnapshot snapshot = pack(pipeline_->memory.state.collect(), tick);
  snapshot.origin = pipeline_->origin;
  if (pipeline_->stages.attachments) snapshot.held = pipeline_->stages.attachments->collect();
  return snapshot;
}

void ClothSimulation::recordRestoreState(vulkan::Recorder& recorder, const StateSnapshot& snapshot) {
  const std::size_t expected = nodeCount() * kSnapshotBytesPerNode;
  if (snapshot.bytes.size() != expected)
    throw std::invalid_argument(
        fmt::format("a snapshot of {} bytes is of another scene: this one's {} nodes take {}",
                    snapshot.bytes.size(), nodeCount(), expected));
  pipeline_->start(recorder);
  pipeline_->memory.state.write(unpack(snapshot, pipeline_->origin),
                                pipeline_->stages.masses.inverseMasses());
  recorder.beginStage("state");
  pipeline_->memory.state.recordUpload(recorder, pipeline_->present);
}

void ClothSimulation::recordRestoreGrabs(vulkan::Recorder& recorder, const HeldNodes& held) {
  Pipeline& on = *pipeline_;
  const bool fits =
      held.grabs.size() <= kMaxGrabs && std::ranges::all_of(held.nodes, [&](const HeldNode& node) {
        return node.node < on.offsets.back() && node.grab < held.grabs.size();
      });
  if (!fits) throw std::invalid_argument("a snapshot holds nodes or grabs that its scene does not have");
  if (!held.grabs.empty()) on.makeAttachments();
  on.start(recorder);
  if (!on.stages.attachments) return;
  recorder.beginStage("state");
  on.stages.attachments->recordRestore(recorder, held);
}

std::vector<shared::SolveRecord> ClothSimulation::solves() const {
  return pipeline_->stages.solvers.records();
}

const model::Vec3& ClothSimulation::origin() const {
  return pipeline_->origin;
}
std::uint32_t ClothSimulation::nodeCount() const {
  return pipeline_->offsets.back();
}
std::span<const std::uint32_t> ClothSimulation::clothOffsets() const {
  return pipeline_->offsets;
}
const Buffer& ClothSimulation::positions(std::uint32_t index) const {
  return pipeline_->memory.state.positions[index];
}
std::uint32_t ClothSimulation::presentIndex() const {
  return pipeline_->present;
}
const Buffer& ClothSimulation::normals() const {
  return pipeline_->memory.normals;
}

}  // namespace clothstream::simulation
