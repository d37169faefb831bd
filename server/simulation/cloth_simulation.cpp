// SPDX-License-Identifier: MIT
// All cloths of one scene on one Vulkan device: the mass-spring pipeline of [Va21].
#include "server/simulation/cloth_simulation.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstring>
#include <iterator>
#include <mutex>
#include <stdexcept>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "kernels/hash_state.h"
#include "server/model/origin.h"
#include "server/simulation/advance_variant.h"
#include "server/simulation/assembled/assembled_stage.h"
#include "server/simulation/attachment/attachment_stage.h"
#include "server/simulation/bending/bending_stage.h"
#include "server/simulation/coarse/coarse_stage.h"
#include "server/simulation/collision/collision_stage.h"
#include "server/simulation/collision/skin_stage.h"
#include "server/simulation/collision/solid_stage.h"
#include "server/simulation/grid_stage.h"
#include "server/simulation/kept_stages.h"
#include "server/simulation/mass_stage.h"
#include "server/simulation/mesh_stage.h"
#include "server/simulation/motion_bound/motion_bound_stage.h"
#include "server/simulation/report_stage.h"
#include "server/simulation/runge_kutta_stage.h"
#include "server/simulation/self_collision/self_collision_stage.h"
#include "server/simulation/solve_stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_memory.h"
#include "server/simulation/texel.h"
#include "server/simulation/xpbd_stage.h"
#include "server/vulkan/kernel.h"
#include "shaders/shared/state_hash.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

std::uint32_t workgroupSizeOn(const vulkan::Device& device, const SimulationOptions& options) {
  const std::uint32_t wanted = options.workgroupSize == 0 ? 64 : options.workgroupSize;
  return std::min(wanted, device.limits().maxWorkgroupInvocations);
}

// Number of invocations that hash a state. They share the nodes and fill the device.
std::uint64_t hashInvocations(const vulkan::Device& device, std::uint32_t nodes) {
  const std::uint64_t nodesPerInvocation = device.hasGpuKernels() ? 8 : 64;
  return (nodes + nodesPerInvocation - 1) / nodesPerInvocation;
}

bool isDamped(const shared::ClothRecord& cloth) {
  return cloth.structuralDamping != 0 || cloth.shearDamping != 0 || cloth.bendDamping != 0;
}

bool isBlown(const shared::ClothRecord& cloth) {
  return cloth.drag != 0 || cloth.lift != 0;
}

// All memory of a scene on the device.
struct Buffers {
  Buffers(const vulkan::Device& device, std::uint32_t nodes, std::size_t clothCount);

  StateMemory state;
  Buffer normals;
  Buffer cloths, status;
  Buffer stretches;  // StateBuffers::stretches
  // Buffers that the CPU writes and reads. Inputs and status alternate between two copies, because a tick may
  // be in flight while the next one is recorded.
  std::array<Buffer, 2> inputs;  // cloths
  Buffer statusReadback;
};

Buffers::Buffers(const vulkan::Device& device, std::uint32_t nodes, std::size_t clothCount)
    : state(device, nodes),
      normals(device, BufferPurpose::texels, nodes * kTexelBytes),
      cloths(device, BufferPurpose::texels, clothCount * sizeof(shared::ClothRecord)),
      status(device, BufferPurpose::state, sizeof(shared::StatusRecord)),
      stretches(device, BufferPurpose::indirect, (kFirstMark + std::size_t{nodes}) * sizeof(std::uint32_t)),
      statusReadback(device, BufferPurpose::readback, 2 * sizeof(shared::StatusRecord)) {
  for (Buffer& buffer : inputs) buffer = Buffer(device, BufferPurpose::upload, cloths.bytes());
}

StateBuffers stateOf(const Buffers& b, const CollisionStage& collision) {
  return {.cloths = b.cloths,
          .colliders = collision.colliders(),
          .nearColliders = collision.nearLists(),
          .contactImpulses = collision.contactImpulses(),
          .stretches = b.stretches,
          .positions = {&b.state.positions[0], &b.state.positions[1]},
          .velocities = {&b.state.velocities[0], &b.state.velocities[1]}};
}

std::vector<model::Solver> solversOf(std::span<const model::Cloth> cloths) {
  std::vector<model::Solver> solvers;
  for (const model::Cloth& cloth : cloths) solvers.push_back(cloth.solver);
  return solvers;
}

std::vector<float> massesOf(std::span<const model::Cloth> cloths) {
  std::vector<float> masses;
  for (const model::Cloth& cloth : cloths) masses.push_back(cloth.mass);
  return masses;
}

// Cloths collide in the advance kernel if no other stage follows.
AdvanceVariant variantOf(std::span<const shared::ClothRecord> cloths, float airDensity, bool colliders,
                         Follow follow) {
  const bool springs = follow != Follow::corrections;
  return {springs && std::any_of(cloths.begin(), cloths.end(), isDamped),
          airDensity != 0 && std::any_of(cloths.begin(), cloths.end(), isBlown),
          colliders && follow == Follow::nothing,
          springs,
          follow == Follow::hold || follow == Follow::paper || follow == Follow::limit,
          follow == Follow::paper};
}

StateBindings bindHash(const vulkan::Device& device, const Buffers& b, std::uint32_t workgroupSize) {
  return bindStates(device, {device, kernels::hash_state, workgroupSize}, [&](std::size_t from) {
    return BufferList{&b.state.positions[from], &b.state.velocities[from], &b.status};
  });
}

}  // namespace

struct ClothSimulation::Pipeline {
  Pipeline(const vulkan::Device& on, const model::Scene& scene, const SimulationOptions& options);

  // Creates the kernels that the present cloths need, and those that they need as soon as a collider appears.
  void prepare();
  std::unique_ptr<XpbdStage> makeXpbd(std::span<const model::Cloth> cloths);
  std::unique_ptr<AssembledStage> makeAssembled(std::span<const model::Cloth> cloths);
  // Cloths of the stage that these cloths need to bend. Empty if the present one serves them, or if none
  // bends.
  std::vector<model::Cloth> bendingCloths(std::span<const model::Cloth> cloths) const;
  // Null without cloths.
  std::unique_ptr<BendingStage> makeBending(std::span<const model::Cloth> cloths) const;
  // Returns null if the present stage serves these cloths, or if none of them bends.
  std::unique_ptr<BendingStage> nextBending(std::span<const model::Cloth> cloths);
  // `stage` replaces the present stage unless it is null.
  void setBending(std::unique_ptr<BendingStage> stage, std::span<const model::Cloth> cloths);
  void makeAttachments(const AttachmentTables& tables);
  // Inputs relative to the origin.
  const TickInputs& nearby(const TickInputs& inputs);
  // Whether setCloths() has to make these.
  bool needsSolvers(std::span<const model::Solver> wanted) const;
  bool needsBending(std::span<const model::Cloth> cloths) const;
  SolverStages makeSolvers(std::span<const model::Cloth> cloths);
  // Makes these stages current, and returns the former ones.
  SolverStages exchangeSolvers(SolverStages next);
  void setSolvers(std::span<const model::Cloth> cloths);
  void makeMassStage();
  void setMasses(std::span<const model::Cloth> cloths);
  void start(vulkan::Recorder& recorder);
  void recordInputs(vulkan::Recorder& recorder, const TickInputs& inputs);
  void recordSubsteps(vulkan::Recorder& recorder, const TickInputs& inputs);
  void recordAdvance(vulkan::Recorder& recorder, std::uint32_t from, const AdvanceVariant& variant,
                     Follow follow, shared::AdvancePush push);
  void recordRungeKutta(vulkan::Recorder& recorder, const TickInputs& inputs, shared::AdvancePush push);
  void recordStatus(vulkan::Recorder& recorder);

  const vulkan::Device& device;
  model::Integrator integrator;
  std::uint32_t substeps;
  double substepSeconds;
  std::uint32_t simulationRate;  // ticks/s
  float tickRate;
  std::vector<std::uint32_t> offsets;
  std::uint32_t nodes;
  std::uint32_t reach;  // HashPush::reach
  model::Vec3 origin;
  float airDensity;  // kg/m^3, of the newest tick
  std::vector<shared::ClothRecord> records;
  std::vector<float> masses;       // 1/kg, by node
  std::vector<float> clothMasses;  // kg
  std::uint32_t workgroupSize;
  Buffers buffers;
  SolidTables solidTables;
  CollisionStage collision;
  GridStage grids;
  StateBindings hash;
  std::unique_ptr<MeshStage> meshes;            // null if no cloth is a mesh
  std::unique_ptr<RungeKuttaStage> rungeKutta;  // null for other integrators
  SolveStage solves;
  std::unique_ptr<XpbdStage> xpbd;                    // null if no cloth uses it
  std::unique_ptr<AssembledStage> assembled;          // null if no cloth uses it
  std::unique_ptr<BendingStage> bending;              // created when a cloth first uses it
  bool bends = false;                                 // true if a cloth uses it now
  std::unique_ptr<CoarseStage> coarse;                // null if no cloth uses it
  std::unique_ptr<SelfCollisionStage> selfCollision;  // null if no cloth uses it
  std::unique_ptr<MotionBoundStage> motionBound;      // null if no cloth uses it
  std::vector<model::Solver> solvers;                 // of the cloths in the tables
  std::uint64_t solverBytes = 0;                      // SolverStages::bytes of the present stages
  KeptStages kept;                                    // stages of earlier solvers
  std::shared_ptr<NewStages> taken;                   // ClothSimulation::takeStages(); may be null
  std::mutex making;                                  // of makeSolvers(): guards the kernels of `solves`
  std::uint64_t made = 0;                             // ClothSimulation::stagesMade()
  std::vector<SpringStiffness> stiffness;             // of the cloths' springs
  std::unique_ptr<SolidStage> solids;                 // null if no collider is a triangle mesh
  std::unique_ptr<SkinStage> skins;                   // null if no mesh has joints
  std::unique_ptr<AttachmentStage> attachments;       // created when it is first needed
  std::unique_ptr<ReportStage> report;                // created for the first report
  std::unique_ptr<MassStage> massChange;              // created when a mass first changes
  SimulationOptions asked;
  TickInputs moved;  // by nearby(), of scenes with an origin elsewhere

  bool started = false;           // the start state is on the device
  bool tabled = false;            // the tables of the solvers are on the device
  bool weighed = true;            // the states on the device have the present masses
  bool namesConstraints = false;  // the last recorded report does
  std::uint32_t present = 0;      // index of the state buffers with the present state
  std::uint32_t slot = 0;         // index of the inputs and status of the last recorded tick
};

ClothSimulation::Pipeline::Pipeline(const vulkan::Device& on, const model::Scene& scene,
                                    const SimulationOptions& options)
    : device(on),
      integrator(scene.integrator),
      substeps(scene.substeps),
      substepSeconds(scene.substepSeconds()),
      simulationRate(scene.simulationRate),
      tickRate(static_cast<float>(scene.simulationRate)),
      offsets(simulation::clothOffsets(scene.cloths)),
      nodes(offsets.back()),
      reach(std::bit_cast<std::uint32_t>(model::reachOf(scene.stream))),
      origin(model::originOf(scene)),
      airDensity(scene.environment.airDensity),
      records(clothRecords(scene.cloths, substepSeconds)),
      masses(inverseMasses(scene.cloths)),
      clothMasses(massesOf(scene.cloths)),
      workgroupSize(workgroupSizeOn(on, options)),
      buffers(on, nodes, records.size()),
      solidTables(simulation::solidTables(scene.colliders)),
      collision(on, solidTables, nodes, static_cast<std::uint32_t>(records.size()),
                {&buffers.state.positions[0], &buffers.state.positions[1]},
                {&buffers.state.velocities[0], &buffers.state.velocities[1]}),
      grids(on, scene.cloths, stateOf(buffers, collision), buffers.normals, integrator,
            {.rowsPerInvocation = options.rowsPerInvocation,
             .workgroupSize = workgroupSize,
             .advanceKernel = options.advanceKernel}),
      hash(bindHash(on, buffers, workgroupSize)),
      solves(on, stateOf(buffers, collision), options.workgroupSize, options.solveWholeNodes),
      stiffness(springStiffness(scene.cloths)),
      asked(options) {
  std::memcpy(buffers.inputs[slot].mapped().data(), records.data(), buffers.cloths.bytes());
  buffers.state.write(restState(scene.cloths, origin), masses);
  const MeshTables meshTables = simulation::meshTables(scene.cloths, workgroupSize);
  if (!meshTables.nodes.empty())
    meshes = std::make_unique<MeshStage>(on, meshTables, stateOf(buffers, collision), buffers.normals,
                                         integrator, workgroupSize);
  if (integrator == model::Integrator::rungeKutta4)
    rungeKutta = std::make_unique<RungeKuttaStage>(on, stateOf(buffers, collision), offsets);
  exchangeSolvers(makeSolvers(scene.cloths));
  bending = makeBending(bendingCloths(scene.cloths));
  bends = bending != nullptr;
  if (CoarseStage::isIn(scene.cloths))
    coarse = std::make_unique<CoarseStage>(on, scene.cloths, stateOf(buffers, collision), workgroupSize);
  if (SelfCollisionStage::isIn(scene))
    selfCollision =
        std::make_unique<SelfCollisionStage>(on, scene, stateOf(buffers, collision), workgroupSize);
  if (!solidTables.empty())
    solids = std::make_unique<SolidStage>(on, solidTables, scene.cloths, stateOf(buffers, collision),
                                          workgroupSize);
  if (SkinTables tables = skinTables(solidTables); !tables.empty())
    skins = std::make_unique<SkinStage>(on, std::move(tables), solidTables, solids->solids(), workgroupSize);
  if (MotionBoundStage::isIn(scene))
    motionBound = std::make_unique<MotionBoundStage>(on, scene, stateOf(buffers, collision), workgroupSize);
  if (const AttachmentTables tables = attachmentTables(scene, origin); !tables.empty()) {
    makeAttachments(tables);
    attachments->setSlack(scene.cloths);
  }
  prepare();
}

void ClothSimulation::Pipeline::makeAttachments(const AttachmentTables& tables) {
  attachments =
      std::make_unique<AttachmentStage>(device, tables, stateOf(buffers, collision), nodes, workgroupSize);
}

void ClothSimulation::Pipeline::prepare() {
  for (const bool colliders : {false, true}) {
    for (const Follow follow : kFollows) {
      const AdvanceVariant variant = variantOf(records, airDensity, colliders, follow);
      grids.prepare(variant, follow);
      if (meshes) meshes->prepare(variant, follow);
    }
    if (xpbd) xpbd->prepare(xpbdVariantOf(records, colliders));
  }
}

std::unique_ptr<XpbdStage> ClothSimulation::Pipeline::makeXpbd(std::span<const model::Cloth> cloths) {
  const bool any = std::ranges::any_of(
      cloths, [](const model::Cloth& cloth) { return cloth.solver.kind == model::SolverKind::xpbd; });
  return any ? std::make_unique<XpbdStage>(device, cloths, stateOf(buffers, collision), asked.workgroupSize,
                                           asked.xpbdWholeNodes)
             : nullptr;
}

std::unique_ptr<AssembledStage> ClothSimulation::Pipeline::makeAssembled(
    std::span<const model::Cloth> cloths) {
  if (!AssembledStage::isIn(cloths)) return nullptr;
  return std::make_unique<AssembledStage>(device, cloths, stateOf(buffers, collision), asked.workgroupSize,
                                          asked.solveWholeNodes);
}

// Cloths that bent once stay in the tables, so that each cloth needs new ones at most once.
std::vector<model::Cloth> ClothSimulation::Pipeline::bendingCloths(
    std::span<const model::Cloth> cloths) const {
  if (!BendingStage::isIn(cloths) || (bending && bending->serves(cloths))) return {};
  std::vector<model::Cloth> all(cloths.begin(), cloths.end());
  for (std::size_t i = 0; bending && i < all.size(); ++i)
    if (bending->bends(i)) all[i].dihedralBending = 1;
  return all;
}

std::unique_ptr<BendingStage> ClothSimulation::Pipeline::makeBending(
    std::span<const model::Cloth> cloths) const {
  if (cloths.empty()) return nullptr;
  return std::make_unique<BendingStage>(device, cloths, stateOf(buffers, collision), workgroupSize);
}

std::unique_ptr<BendingStage> ClothSimulation::Pipeline::nextBending(std::span<const model::Cloth> cloths) {
  const std::vector<model::Cloth> all = bendingCloths(cloths);
  if (!all.empty() && !needsBending(cloths)) return std::move(taken->bending);
  return makeBending(all);
}

void ClothSimulation::Pipeline::setBending(std::unique_ptr<BendingStage> stage,
                                           std::span<const model::Cloth> cloths) {
  if (stage) {
    bending = std::move(stage);
    ++made;
    tabled = false;
  }
  bends = BendingStage::isIn(cloths);
}

bool ClothSimulation::Pipeline::needsSolvers(std::span<const model::Solver> wanted) const {
  const bool has = haveSameTables(wanted, solvers) || kept.has(wanted) ||
                   (taken && taken->solvers && haveSameTables(wanted, taken->solvers->solvers));
  return !has;
}

bool ClothSimulation::Pipeline::needsBending(std::span<const model::Cloth> cloths) const {
  const bool isTaken = taken && taken->bending && taken->bending->serves(cloths);
  return !isTaken && !bendingCloths(cloths).empty();
}

SolverStages ClothSimulation::Pipeline::makeSolvers(std::span<const model::Cloth> cloths) {
  const std::lock_guard lock(making);
  const std::uint64_t before = Buffer::bytesOfThread();
  SolverStages stages{.solvers = solversOf(cloths),
                      .systems = solves.makeSystems(cloths),
                      .xpbd = makeXpbd(cloths),
                      .assembled = makeAssembled(cloths)};
  stages.bytes = Buffer::bytesOfThread() - before;
  return stages;
}

SolverStages ClothSimulation::Pipeline::exchangeSolvers(SolverStages next) {
  return {.solvers = std::exchange(solvers, std::move(next.solvers)),
          .systems = solves.exchange(std::move(next.systems)),
          .xpbd = std::exchange(xpbd, std::move(next.xpbd)),
          .assembled = std::exchange(assembled, std::move(next.assembled)),
          .bytes = std::exchange(solverBytes, next.bytes)};
}

void ClothSimulation::Pipeline::setSolvers(std::span<const model::Cloth> cloths) {
  const std::vector<model::Solver> wanted = solversOf(cloths);
  if (haveSameTables(wanted, solvers)) return;
  // Memory is allocated before anything changes, because that may fail.
  std::optional<SolverStages> known = kept.take(wanted);
  if (!known && !needsSolvers(wanted)) known = std::exchange(taken->solvers, std::nullopt);
  if (!known) {
    known = makeSolvers(cloths);
    ++made;
  }
  kept.keep(exchangeSolvers(std::move(*known)));
  grids.setTiles(cloths);
  if (meshes) meshes->setTiles(meshTiles(cloths, workgroupSize));
  tabled = false;
}

void ClothSimulation::Pipeline::makeMassStage() {
  if (massChange) return;
  const Buffers& b = buffers;
  massChange = std::make_unique<MassStage>(
      device, nodes, std::array{&b.state.positions[0], &b.state.positions[1], &b.state.checkpointPositions});
}

void ClothSimulation::Pipeline::setMasses(std::span<const model::Cloth> cloths) {
  masses = inverseMasses(cloths);
  massChange->set(masses);
  clothMasses = massesOf(cloths);
  weighed = false;
}

void ClothSimulation::Pipeline::start(vulkan::Recorder& recorder) {
  recorder.barrier();
  if (started && tabled && weighed) return;
  if (!started) {
    recorder.copy(buffers.inputs[slot], buffers.cloths, buffers.cloths.bytes());
    buffers.state.recordUpload(recorder, present);
  }
  grids.recordTables(recorder);
  if (meshes) meshes->recordTables(recorder);
  if (solves.active()) solves.recordTables(recorder);
  if (xpbd) xpbd->recordTables(recorder);
  if (assembled) assembled->recordTables(recorder);
  if (bending) bending->recordTables(recorder);
  if (!started) {
    if (coarse) coarse->recordTables(recorder);
    if (selfCollision) selfCollision->recordTables(recorder);
    if (solids) solids->recordTables(recorder);
    if (skins) skins->recordTables(recorder);
    if (motionBound) motionBound->recordTables(recorder);
  }
  recorder.barrier();
  if (!weighed) {
    massChange->record(recorder);
    recorder.barrier();
  }
  started = tabled = weighed = true;
}

const TickInputs& ClothSimulation::Pipeline::nearby(const TickInputs& inputs) {
  if (origin.isZero(0)) return inputs;
  moved = inputs;
  for (MovingCollider& collider : moved.colliders)
    for (model::Pose* pose : {&collider.start, &collider.end}) pose->position -= origin;
  for (model::Pose& pose : moved.attachments) pose.position -= origin;
  for (model::Carry& carry : moved.carries)
    for (model::Pose* pose : {&carry.from, &carry.to}) pose->position -= origin;
  for (Grab& grab : moved.grabs)
    for (model::Pose* pose : {&grab.start, &grab.end}) pose->position -= origin;
  return moved;
}

void ClothSimulation::Pipeline::recordInputs(vulkan::Recorder& recorder, const TickInputs& inputs) {
  slot = 1 - slot;
  const Buffer& from = buffers.inputs[slot];
  const std::size_t clothBytes = buffers.cloths.bytes();
  std::memcpy(from.mapped().data(), records.data(), clothBytes);
  recorder.beginStage("inputs");
  recorder.copy(from, buffers.cloths, clothBytes);
  if (skins) skins->recordInputs(recorder, inputs.colliders);
  collision.recordInputs(recorder, inputs.colliders, inputs.reportsContacts);
  if (!attachments && !inputs.grabs.empty()) makeAttachments({});
  if (attachments) attachments->recordInputs(recorder, inputs.attachments, inputs.grabs);
  recorder.fill(buffers.status, 0, buffers.status.bytes());
  if (selfCollision) selfCollision->recordClear(recorder);
  if (motionBound) motionBound->recordClear(recorder);
}

void ClothSimulation::Pipeline::recordAdvance(vulkan::Recorder& recorder, std::uint32_t from,
                                              const AdvanceVariant& variant, Follow follow,
                                              shared::AdvancePush push) {
  push.stretchSize = firstStretchSize(follow);
  push.stretchGroups = solves.stretchGroups(follow);
  grids.recordAdvance(recorder, from, variant, follow, push);
  if (meshes) meshes->recordAdvance(recorder, from, variant, follow, push);
}

void ClothSimulation::Pipeline::recordRungeKutta(vulkan::Recorder& recorder, const TickInputs& inputs,
                                                 shared::AdvancePush push) {
  const AdvanceVariant variant = variantOf(records, inputs.environment.airDensity, false, Follow::nothing);
  rungeKutta->record(recorder, present, push.collision, [&](std::uint32_t from, float part) {
    push.stepSeconds = part * static_cast<float>(substepSeconds);
    recordAdvance(recorder, from, variant, Follow::nothing, push);
  });
}

void ClothSimulation::Pipeline::recordSubsteps(vulkan::Recorder& recorder, const TickInputs& inputs) {
  const model::Environment& environment = inputs.environment;
  shared::AdvancePush push{.gravity = vectorOf(environment.gravity),
                           .stepSeconds = static_cast<float>(substepSeconds),
                           .wind = vectorOf(environment.wind),
                           .airFactor = environment.airDensity / 6,
                           .collision = {},
                           .firstTile = 0,
                           .stretchSize = 0,
                           .stretchGroups = 0,
                           .firstMark = kFirstMark};
  if (attachments && attachments->aims()) {
    recorder.beginStage("attachments");
    recorder.barrier();
    if (!inputs.carries.empty()) {
      attachments->recordCarries(recorder, present, inputs.carries, offsets);
      recorder.barrier();
    }
    attachments->recordAim(recorder, present, tickRate);
  }
  if (collision.active()) {
    float thickness = 0;
    for (const shared::ClothRecord& record : records) thickness = std::max(thickness, record.thickness);
    recorder.beginStage("near");
    recorder.barrier();
    collision.recordGather(recorder, present, 1 / tickRate, thickness);
  }
  if (skins && collision.solidCount() > 0) {
    recorder.beginStage("skins");
    skins->record(recorder);
  }
  recorder.beginStage("advance");
  for (std::uint32_t substep = 0; substep < substeps; ++substep) {
    push.collision = collision.push(substep, substeps, tickRate);
    recorder.barrier();
    if (coarse &&
        coarse->record(recorder, present, {substep, substeps, substepSeconds}, push.collision, records))
      recorder.barrier();
    if (bends) {
      bending->record(recorder, present, substepSeconds);
      recorder.barrier();
    }
    if (rungeKutta) {
      recordRungeKutta(recorder, inputs, push);
    } else {
      for (const Follow follow : kFollows)
        recordAdvance(recorder, present,
                      variantOf(records, inputs.environment.airDensity, collision.active(), follow), follow,
                      push);
    }
    if (solves.active())
      solves.record(recorder, present, push.collision, substepSeconds, substep + 1 == substeps);
    if (assembled)
      assembled->record(recorder, present, push.collision, substepSeconds, substep + 1 == substeps);
    if (xpbd)
      xpbd->record(recorder, present, xpbdVariantOf(records, collision.active()),
                   {.collision = push.collision,
                    .substepSeconds = static_cast<float>(substepSeconds),
                    .substepRate = tickRate * static_cast<float>(substeps),
                    .firstTile = 0,
                    .reserved = 0});
    if (attachments) attachments->recordSubstep(recorder, present, substep, substeps, tickRate);
    if (selfCollision) selfCollision->recordSubstep(recorder, present, substep, push.collision);
    if (collision.solidCount() > 0) solids->record(recorder, present, push.collision, collision.solidCount());
    if (motionBound) motionBound->recordSubstep(recorder, present);
    present = 1 - present;
  }
}

void ClothSimulation::Pipeline::recordStatus(vulkan::Recorder& recorder) {
  recorder.beginStage("hash");
  recorder.barrier();
  recorder.dispatch(hash[present], shared::HashPush{vectorOf(origin), nodes, reach},
                    hashInvocations(device, nodes));
  if (motionBound)
    motionBound->recordDepths(recorder, present, collision.push(substeps - 1, substeps, tickRate));
  recorder.barrier();
  recorder.copy(buffers.status, buffers.statusReadback, sizeof(shared::StatusRecord), 0,
                slot * sizeof(shared::StatusRecord));
  if (solves.active()) solves.recordReport(recorder);
  if (assembled) assembled->recordReport(recorder);
  if (selfCollision) selfCollision->recordReport(recorder, slot);
  if (motionBound) motionBound->recordReport(recorder, slot);
  if (attachments) attachments->recordReport(recorder);
  collision.recordContacts(recorder);
}

ClothSimulation::ClothSimulation(const vulkan::Device& device, const model::Scene& scene,
                                 SimulationOptions options)
    : pipeline_(std::make_unique<Pipeline>(device, scene, options)) {}

ClothSimulation::~ClothSimulation() = default;

void ClothSimulation::setCloths(std::span<const model::Cloth> cloths) {
  std::vector<shared::ClothRecord> records = clothRecords(cloths, pipeline_->substepSeconds);
  assert(records.size() == pipeline_->records.size());
  assert(std::equal(records.begin(), records.end(), pipeline_->records.begin(),
                    [](const shared::ClothRecord& a, const shared::ClothRecord& b) {
                      return a.rows == b.rows && a.columns == b.columns;
                    }));
  const bool heavier = massesOf(cloths) != pipeline_->clothMasses;
  if (heavier) pipeline_->makeMassStage();
  std::unique_ptr<BendingStage> bending = pipeline_->nextBending(cloths);
  pipeline_->setSolvers(cloths);
  pipeline_->setBending(std::move(bending), cloths);
  pipeline_->taken.reset();
  if (heavier) pipeline_->setMasses(cloths);
  if (pipeline_->selfCollision) pipeline_->selfCollision->setCloths(cloths);
  if (pipeline_->motionBound) pipeline_->motionBound->setCloths(cloths);
  if (pipeline_->attachments) pipeline_->attachments->setSlack(cloths);
  pipeline_->stiffness = springStiffness(cloths);
  pipeline_->records = std::move(records);
  pipeline_->prepare();
}

bool ClothSimulation::makesStages(std::span<const model::Cloth> cloths) const {
  return pipeline_->needsSolvers(solversOf(cloths)) || pipeline_->needsBending(cloths);
}

StagePlan ClothSimulation::planStages(std::span<const model::Cloth> cloths) const {
  StagePlan plan{.solvers = {}, .bending = pipeline_->bendingCloths(cloths)};
  if (pipeline_->needsSolvers(solversOf(cloths))) plan.solvers.assign(cloths.begin(), cloths.end());
  return plan;
}

std::shared_ptr<NewStages> ClothSimulation::makeStages(const StagePlan& plan) {
  auto stages = std::make_shared<NewStages>();
  if (!plan.solvers.empty()) stages->solvers = pipeline_->makeSolvers(plan.solvers);
  stages->bending = pipeline_->makeBending(plan.bending);
  return stages;
}

void ClothSimulation::takeStages(std::shared_ptr<NewStages> stages) {
  pipeline_->taken = std::move(stages);
}

std::uint64_t ClothSimulation::stagesMade() const {
  return pipeline_->made;
}

void ClothSimulation::setSubsteps(std::uint32_t substeps, std::span<const model::Cloth> cloths) {
  Pipeline& on = *pipeline_;
  on.substeps = substeps;
  on.substepSeconds = 1.0 / on.simulationRate / substeps;
  on.records = clothRecords(cloths, on.substepSeconds);
  if (on.selfCollision) on.selfCollision->setSubsteps(substeps, on.substepSeconds);
  if (on.motionBound) on.motionBound->setSubstepSeconds(on.substepSeconds);
}

void ClothSimulation::recordTick(vulkan::Recorder& recorder, const TickInputs& inWorld) {
  assert(inWorld.colliders.size() <= kMaxColliders);
  const TickInputs& inputs = pipeline_->nearby(inWorld);
  pipeline_->airDensity = inputs.environment.airDensity;
  pipeline_->start(recorder);
  pipeline_->recordInputs(recorder, inputs);
  pipeline_->recordSubsteps(recorder, inputs);
  pipeline_->recordStatus(recorder);
}

void ClothSimulation::recordNormals(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("normals");
  pipeline_->grids.recordNormals(recorder, pipeline_->present);
  if (pipeline_->meshes) pipeline_->meshes->recordNormals(recorder, pipeline_->present);
}

void ClothSimulation::recordReport(vulkan::Recorder& recorder, const TickInputs& inputs) {
  Pipeline& on = *pipeline_;
  if (!on.report)
    on.report = std::make_unique<ReportStage>(on.device, on.records, stateOf(on.buffers, on.collision),
                                              on.meshes ? on.meshes->springs() : MeshSprings{},
                                              on.solids.get(), on.asked.workgroupSize);
  recorder.beginStage("report");
  on.report->record(recorder, on.present, on.stiffness, inputs.environment.gravity, on.origin,
                    on.collision.push(on.substeps - 1, on.substeps, on.tickRate), on.collision.solidCount());
  on.namesConstraints = inputs.namesConstraints && on.solves.active();
  if (!on.namesConstraints) return;
  const std::uint64_t before = Buffer::bytesOfThread();
  on.solves.recordActiveSprings(recorder);
  on.solverBytes += Buffer::bytesOfThread() - before;
}

std::vector<ContactStatus> ClothSimulation::contacts() const {
  return pipeline_->collision.contacts();
}

std::vector<float> ClothSimulation::depths() const {
  if (!pipeline_->motionBound) return {};
  return pipeline_->collision.inOrder(pipeline_->motionBound->depths(pipeline_->slot));
}

std::vector<GrabStatus> ClothSimulation::grabs() const {
  std::vector<GrabStatus> grabs;
  if (pipeline_->attachments)
    for (const shared::GrabReport& report : pipeline_->attachments->report())
      grabs.push_back(statusOf(report));
  return grabs;
}

std::vector<ClothReport> ClothSimulation::report() const {
  assert(pipeline_->report);
  std::vector<ClothReport> reports = pipeline_->report->collect();
  const auto take = [&](const auto& stage) {
    const std::span<const shared::SolveRecord> solves = stage.report();
    for (std::size_t i = 0; i < solves.size(); ++i) {
      ClothReport& report = reports[stage.cloths()[i]];
      report.activeConstraints = solves[i].constraints;
      report.iterations = solves[i].iterations;
      report.residual = solves[i].residual;
    }
  };
  if (pipeline_->solves.active()) take(pipeline_->solves);
  if (pipeline_->assembled) take(*pipeline_->assembled);
  return reports;
}

std::vector<std::vector<std::uint32_t>> ClothSimulation::constraintEnds() const {
  std::vector<std::vector<std::uint32_t>> ends(pipeline_->records.size());
  if (pipeline_->namesConstraints) pipeline_->solves.activeSprings(kMostNamedConstraints, ends);
  return ends;
}

TickStatus ClothSimulation::status() const {
  const shared::StatusRecord& record =
      pipeline_->buffers.statusReadback.mapped<shared::StatusRecord>()[pipeline_->slot];
  TickStatus status{.stateHash = std::uint64_t{record.hashHigh} << 32 | record.hashLow,
                    .healthy = record.unhealthy == 0,
                    .outOfReach = record.unhealthy == shared::kOutOfReach};
  for (int axis = 0; axis < 3; ++axis) {
    status.low[axis] = std::bit_cast<float>(shared::bitsInOrder(~record.invertedLow[axis]));
    status.high[axis] = std::bit_cast<float>(shared::bitsInOrder(record.high[axis]));
  }
  if (pipeline_->selfCollision) {
    const shared::CrowdReport& report = pipeline_->selfCollision->report(pipeline_->slot);
    status.crowded = report.lists + report.balls;
  }
  if (pipeline_->motionBound) status.crowded += pipeline_->motionBound->report(pipeline_->slot).overflows;
  return status;
}

void ClothSimulation::recordCheckpoint(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("checkpoint");
  pipeline_->buffers.state.recordCheckpoint(recorder, pipeline_->present);
}

void ClothSimulation::recordRollback(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("checkpoint");
  pipeline_->buffers.state.recordRollback(recorder, pipeline_->present);
}

void ClothSimulation::recordSaveState(vulkan::Recorder& recorder) {
  pipeline_->start(recorder);
  recorder.beginStage("state");
  pipeline_->buffers.state.recordSave(recorder, pipeline_->present);
  if (pipeline_->attachments) pipeline_->attachments->recordSave(recorder);
}

StateSnapshot ClothSimulation::collectState(std::uint64_t tick) const {
  StateSnapshot snapshot = pack(pipeline_->buffers.state.collect(), tick);
  snapshot.origin = pipeline_->origin;
  if (pipeline_->attachments) snapshot.held = pipeline_->attachments->collect();
  return snapshot;
}

void ClothSimulation::recordRestoreState(vulkan::Recorder& recorder, const StateSnapshot& snapshot) {
  const std::size_t expected = pipeline_->nodes * kSnapshotBytesPerNode;
  if (snapshot.bytes.size() != expected)
    throw std::invalid_argument(
        fmt::format("a snapshot of {} bytes is of another scene: this one's {} nodes take {}",
                    snapshot.bytes.size(), pipeline_->nodes, expected));
  pipeline_->start(recorder);
  pipeline_->buffers.state.write(unpack(snapshot, pipeline_->origin), pipeline_->masses);
  recorder.beginStage("state");
  pipeline_->buffers.state.recordUpload(recorder, pipeline_->present);
}

void ClothSimulation::recordRestoreGrabs(vulkan::Recorder& recorder, const HeldNodes& held) {
  Pipeline& on = *pipeline_;
  const bool fits =
      held.grabs.size() <= kMaxGrabs && std::ranges::all_of(held.nodes, [&](const HeldNode& node) {
        return node.node < on.nodes && node.grab < held.grabs.size();
      });
  if (!fits) throw std::invalid_argument("a snapshot holds nodes or grabs that its scene does not have");
  on.start(recorder);
  if (!on.attachments && held.grabs.empty()) return;
  if (!on.attachments) on.makeAttachments({});
  recorder.beginStage("state");
  on.attachments->recordRestore(recorder, held);
}

std::vector<shared::SolveRecord> ClothSimulation::solves() const {
  std::vector<shared::SolveRecord> solves;
  const auto take = [&](const auto& stage) { std::ranges::copy(stage.report(), std::back_inserter(solves)); };
  if (pipeline_->solves.active()) take(pipeline_->solves);
  if (pipeline_->assembled) take(*pipeline_->assembled);
  return solves;
}

const model::Vec3& ClothSimulation::origin() const {
  return pipeline_->origin;
}
std::uint32_t ClothSimulation::nodeCount() const {
  return pipeline_->nodes;
}
std::span<const std::uint32_t> ClothSimulation::clothOffsets() const {
  return pipeline_->offsets;
}
const Buffer& ClothSimulation::positions(std::uint32_t index) const {
  return pipeline_->buffers.state.positions[index];
}
std::uint32_t ClothSimulation::presentIndex() const {
  return pipeline_->present;
}
const Buffer& ClothSimulation::normals() const {
  return pipeline_->buffers.normals;
}

}  // namespace clothstream::simulation
