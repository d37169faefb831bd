// SPDX-License-Identifier: MIT
// Linear systems on the device.
#include "server/simulation/solve_stage.h"

#include <algorithm>
#include <array>
#include <bit>
#include <optional>
#include <utility>
#include <vector>

#include "kernels/apply_velocities.h"
#include "kernels/check_stretch.h"
#include "kernels/multiply_residuals.h"
#include "kernels/prepare_grids.h"
#include "kernels/prepare_meshes.h"
#include "kernels/prepare_springs.h"
#include "kernels/solve_velocities.h"
#include "kernels/update_corrections.h"
#include "server/simulation/active_springs.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stretched_systems.h"
#include "server/simulation/workgroup_work.h"

namespace clothstream::simulation {
namespace {

using vulkan::Bindings;
using vulkan::Buffer;
using vulkan::BufferPurpose;
using vulkan::Kernel;

constexpr std::uint32_t kSolveLanes = CLOTHSTREAM_SOLVE_LANES;
// shaders/solve/linear_system.glsl, and solve_stretched.comp.
constexpr std::uint32_t kVectors = 6, kStretchedVectors = 7;
// Dispatch sizes of a round, x, y, z each: of a group's prepared chunks, of its small systems, of all chunks
// in the next round, of the iterations of large systems.
constexpr std::uint32_t kSize = 3, kSmallSystems = kSize, kNextRound = 2 * kSize, kIteration = 3 * kSize;

std::uint32_t sizesOfRound(const SolveGroup& group) {
  if (group.stretched) return kSize;
  return kIteration + kSize * (group.iterations + 1);
}

bool isAdaptive(const SolveGroup& group) {
  return group.kind == model::SolverKind::acad;
}

bool isPaper(const SolveGroup& group) {
  return isAdaptive(group) && group.acadMode == model::AcadMode::paper;
}

bool isLimit(const SolveGroup& group) {
  return isAdaptive(group) && group.acadMode == model::AcadMode::limit;
}

bool isStretched(const SolveGroup& group) {
  return group.stretched;
}

bool isImplicit(const SolveGroup& group) {
  return group.kind == model::SolverKind::implicitEuler;
}

// Partition of the work. The results do not depend on it.
struct SolveCut {
  std::uint32_t workgroup;           // invocations of a chunk
  std::uint32_t iterationWorkgroup;  // of a chunk in the kernels of an iteration
  std::uint32_t wholeNodes;          // nodes of the largest cloth that one workgroup solves
  bool spread;                       // in an iteration, each node of a walk has its own invocation
};

// A workgroup handles one chunk, or solves a system chunk by chunk with barriers between its passes. On a
// software device barriers cost nothing if the workgroup is no wider than the CPU's vectors, because it then
// does not switch between invocations. Loops over lanes rely on a width that divides their number.
SolveCut cutSolves(const vulkan::Device& device, std::uint32_t wanted,
                   std::optional<std::uint32_t> wholeNodes) {
  const bool gpu = device.hasGpuKernels();
  const auto workgroup = [&](std::uint32_t invocations, std::uint32_t most) {
    if (wanted != 0) invocations = wanted;
    return std::bit_floor(std::min({invocations, most, device.limits().maxWorkgroupInvocations}));
  };
  const std::uint32_t places = gpu ? kSolveLanes * CLOTHSTREAM_SOLVE_WALK : kSolveLanes;
  return {.workgroup = workgroup(gpu ? kSolveLanes : 8, kSolveLanes),
          .iterationWorkgroup = workgroup(gpu ? places : 8, places),
          .wholeNodes = wholeNodes.value_or(gpu ? 1024 : 4096),
          .spread = gpu};
}

constexpr std::uint32_t kChunkNodes = kSolveLanes * CLOTHSTREAM_SOLVE_WALK;
// Work of a node (vulkan::Recorder::dispatch) when the system is prepared.
constexpr std::uint32_t kPrepareWork = 12;

// lavapipe allows an invocation 65,535 loop rounds, over all loops together. Beyond that it ends each loop
// after one round.
WholeLimits wholeLimits(const vulkan::Device& device, const SolveCut& cut) {
  return {.nodes = cut.wholeNodes,
          .workgroup = cut.iterationWorkgroup,
          .spread = cut.spread,
          .mostLoops = device.isSoftware() ? 65'535 : kUnlimitedLoops};
}

std::uint32_t iterationsPerDispatch(const vulkan::Device& device, const SolveGroup& group,
                                    const SolveCut& cut) {
  const std::uint32_t nodes = std::max(1u, group.smallChunks * kChunkNodes);
  const std::uint32_t most = std::max(1u, nodesPerDispatch(device) / nodes);
  if (group.smallLoops == 0) return most;
  // At least one, because the system would not be small otherwise.
  return std::min(wholeLimits(device, cut).mostLoops / group.smallLoops - kSpareIterations, most);
}

}  // namespace

// Kernels of a group. Those that it does not need are absent: for systems that one workgroup solves, or for
// larger ones.
struct GroupKernels {
  std::optional<Kernel> check, springs, prepare, whole, multiply, measure, update;
};

struct SolveStage::Kernels {
  Kernels(const vulkan::Device& on, const SolveCut& partition, const StretchedLimits& limits)
      : device(on), cut(partition), stretched(on, limits) {}

  Kernel make(const vulkan::KernelCode& code, const SolveGroup& group, bool iterates = false,
              bool measure = false) const {
    return Kernel(
        device, code, iterates ? cut.iterationWorkgroup : cut.workgroup,
        {isImplicit(group) ? 1u : 0u, group.mesh ? 1u : 0u, group.bend ? 1u : 0u, isAdaptive(group) ? 1u : 0u,
         measure ? 1u : 0u, cut.spread ? 1u : 0u, isPaper(group) ? 1u : 0u});
  }

  const GroupKernels& of(const SolveGroup& group) {
    const std::size_t mode = static_cast<std::size_t>(group.acadMode);
    const std::size_t kind = isImplicit(group) ? 1 : (isAdaptive(group) ? 2 + mode : 0);
    GroupKernels& on = groups[(2 * kind + (group.mesh ? 1 : 0)) * 2 + (group.bend ? 1 : 0)];
    if (!on.prepare && group.mesh) {
      on.springs = make(kernels::prepare_springs, group);
      on.prepare = make(kernels::prepare_meshes, group);
    } else if (!on.prepare) {
      if (isAdaptive(group)) on.check = make(kernels::check_stretch, group);
      on.prepare = make(kernels::prepare_grids, group);
    }
    if (!on.whole && group.smallSystems > 0) on.whole = make(kernels::solve_velocities, group, true);
    if (!on.multiply && group.hasLarge()) {
      on.multiply = make(kernels::multiply_residuals, group, true);
      on.measure = make(kernels::multiply_residuals, group, true, true);
      on.update = make(kernels::update_corrections, group, true);
    }
    return on;
  }

  const Kernel& apply(const SolveGroup& group) {
    std::optional<Kernel>& kernel = applies[group.mesh ? 1 : 0];
    if (!kernel) kernel = make(kernels::apply_velocities, group);
    return *kernel;
  }

  const vulkan::Device& device;
  SolveCut cut;
  std::array<GroupKernels, 16> groups;
  std::array<std::optional<Kernel>, 2> applies;
  StretchedKernels stretched;
};

// With the bindings.
struct SolveStage::Systems {
  // A group with its bindings, one for each index of the state buffer that has the state.
  struct Group {
    SolveGroup on;
    std::uint32_t iterationsPerDispatch;
    std::uint32_t firstSize;  // index of its first dispatch size
    std::uint32_t firstSizeOf(std::uint32_t round) const { return firstSize + round * sizesOfRound(on); }
    std::vector<Bindings> check{}, springs{}, prepare{}, whole{}, multiply{}, measure{}, update{}, apply{};
  };

  Systems(const vulkan::Device& device, const SolveTables& tables, const StateBuffers& state,
          Kernels& kernels)
      : nodes(tables.nodes),
        cut(kernels.cut),
        stretches(state.stretches),
        systems(device, tables.systems),
        chunks(device, tables.chunks),
        springs(device, tables.springs),
        incidences(device, tables.incidences),
        lists(device, tables.lists),
        emptyGroups(device, BufferPurpose::upload, allSizes(tables) * sizeof(std::uint32_t)),
        groupSizes(device, BufferPurpose::indirect, emptyGroups.bytes()),
        along(device, BufferPurpose::texels,
              texels(2 * nodes, has(tables, [](auto& g) { return !g.mesh && !g.stretched; }))),
        across(device, BufferPurpose::texels,
               texels(2 * nodes, has(tables, [](auto& g) { return !g.mesh && isImplicit(g); }))),
        rows(device, BufferPurpose::texels, texels(tables.springs.size(), !tables.springs.empty())),
        impulses(device, BufferPurpose::texels, rows.bytes()),
        vectors(device, BufferPurpose::texels,
                texels((has(tables, isStretched) ? kStretchedVectors : kVectors) * std::size_t{nodes}, true)),
        sums(device, BufferPurpose::state, tables.chunks.size() * 2 * sizeof(float)),
        actives(device, BufferPurpose::state, 3 * tables.chunks.size() * sizeof(std::uint32_t)),
        solves(device, BufferPurpose::state, tables.systems.size() * sizeof(shared::SolveRecord)),
        solvesReadback(device, BufferPurpose::readback, solves.bytes()) {
    const std::span<std::uint32_t> numbers = emptyGroups.mapped<std::uint32_t>();
    for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i % kSize == 0 ? 0 : 1;
    for (const shared::SystemRecord& system : tables.systems)
      cloths.push_back(static_cast<std::uint32_t>(system.cloth));
    if (has(tables, isStretched))
      stretched = std::make_unique<StretchedSystems>(
          device, kernels.stretched, tables, state,
          StretchedSystems::Buffers{systems.texels(), chunks.texels(), vectors, solves});
    onlyStretched = std::ranges::all_of(tables.groups, isStretched);
    named = activeTables(tables);
    std::uint32_t size = 0;
    for (const SolveGroup& on : tables.groups) {
      groups.push_back({.on = on,
                        .iterationsPerDispatch = simulation::iterationsPerDispatch(device, on, cut),
                        .firstSize = size});
      size += roundsOf(on) * sizesOfRound(on);
      for (const std::size_t from : {0, 1}) bind(device, kernels, state, from, groups.back());
    }
  }

  static std::size_t allSizes(const SolveTables& tables) {
    std::size_t sizes = 0;
    for (const SolveGroup& group : tables.groups) sizes += roundsOf(group) * sizesOfRound(group);
    return sizes;
  }
  static bool has(const SolveTables& tables, auto what) { return std::ranges::any_of(tables.groups, what); }
  // Bindings need a buffer even for an empty table.
  static std::size_t texels(std::size_t count, bool any) { return (any ? count : 1) * sizeof(shared::vec4); }

  void bind(const vulkan::Device& device, Kernels& kernels, const StateBuffers& state, std::size_t from,
            Group& group) {
    const Buffer &position = *state.positions[from], &freePosition = *state.positions[1 - from],
                 &velocity = *state.velocities[from], &freeVelocity = *state.velocities[1 - from];
    group.apply.emplace_back(
        device, kernels.apply(group.on),
        std::initializer_list<const Buffer*>{&state.cloths, &systems.texels(), &chunks.texels(), &vectors,
                                             &state.colliders, &state.nearColliders, &position, &freePosition,
                                             &freeVelocity, &actives, &state.contactImpulses, &groupSizes});
    if (group.on.stretched) return;
    const GroupKernels& with = kernels.of(group.on);
    const auto bindTo = [&](std::vector<Bindings>& bindings, const std::optional<Kernel>& kernel,
                            std::vector<const Buffer*> first, std::initializer_list<const Buffer*> more) {
      first.insert(first.end(), more);
      bindings.emplace_back(device, *kernel, first);
    };
    // The lengths that decide which springs ACAD constrains.
    const Buffer& decisive = isPaper(group.on) ? position : freePosition;
    // The positions where constraints are linearised.
    const Buffer& linear = isLimit(group.on) ? freePosition : position;
    const std::vector<const Buffer*> weighing = {&state.cloths, &systems.texels(), &chunks.texels(), &linear,
                                                 &velocity,     &freeVelocity,     &decisive,        &solves,
                                                 &actives,      &groupSizes};
    if (with.check) bindTo(group.check, with.check, weighing, {});
    if (group.on.mesh) {
      bindTo(group.springs, with.springs, weighing, {&springs.texels(), &rows, &impulses});
      bindTo(group.prepare, with.prepare, weighing,
             {&incidences.texels(), &lists.texels(), &rows, &impulses, &vectors});
    } else {
      bindTo(group.prepare, with.prepare, weighing, {&along, &across, &vectors});
    }
    const std::vector<const Buffer*> iterating = {&state.cloths,
                                                  &systems.texels(),
                                                  &chunks.texels(),
                                                  &linear,
                                                  &incidences.texels(),
                                                  &lists.texels(),
                                                  group.on.mesh ? &rows : &along,
                                                  &across,
                                                  &vectors,
                                                  &vectors,
                                                  &sums,
                                                  &solves,
                                                  &actives};
    if (group.on.smallSystems > 0) bindTo(group.whole, with.whole, iterating, {});
    if (group.on.hasLarge()) {
      bindTo(group.multiply, with.multiply, iterating, {&groupSizes});
      bindTo(group.measure, with.measure, iterating, {&groupSizes});
      bindTo(group.update, with.update, iterating, {});
    }
  }

  void recordPrepare(vulkan::Recorder& recorder, const Group& group, std::uint32_t from, std::uint32_t round,
                     double h) const;
  void recordSmall(vulkan::Recorder& recorder, const Group& group, std::uint32_t from,
                   std::uint32_t round) const;
  void recordLarge(vulkan::Recorder& recorder, const Group& group, std::uint32_t from,
                   std::uint32_t round) const;

  void recordApply(vulkan::Recorder& recorder, const Group& group, std::uint32_t from, std::uint32_t round,
                   const shared::CollisionPush& collision, double h) const;

  std::uint32_t nodes;
  SolveCut cut;
  const Buffer& stretches;  // StateBuffers::stretches
  std::vector<std::uint32_t> cloths;
  DeviceTable systems, chunks, springs, incidences, lists;
  Buffer emptyGroups, groupSizes;
  Buffer along, across, rows, impulses, vectors, sums, actives, solves, solvesReadback;
  std::vector<Group> groups;
  std::unique_ptr<StretchedSystems> stretched;  // null if no group uses it
  ActiveTables named;
  std::unique_ptr<ActiveSprings> marked;  // created at the first request
  bool onlyStretched = false;
};

SolveStage::SolveStage(const vulkan::Device& device, const StateBuffers& state, std::uint32_t workgroupSize,
                       std::optional<std::uint32_t> wholeNodes)
    : device_(device),
      state_(state),
      kernels_(std::make_unique<Kernels>(
          device, cutSolves(device, workgroupSize, wholeNodes),
          stretchedLimits(device, workgroupSize,
                          wholeNodes.value_or(CLOTHSTREAM_STRETCHED_CHUNKS * kChunkNodes)))) {}

SolveStage::~SolveStage() = default;

std::shared_ptr<SolveStage::Systems> SolveStage::makeSystems(std::span<const model::Cloth> cloths) {
  const SolveTables tables =
      solveTables(cloths, wholeLimits(device_, kernels_->cut), kernels_->stretched.limits());
  return tables.systems.empty() ? nullptr : std::make_shared<Systems>(device_, tables, state_, *kernels_);
}

void SolveStage::use(std::shared_ptr<Systems> systems) {
  outdate();
  systems_ = std::move(systems);
}

void SolveStage::recordTables(vulkan::Recorder& recorder) {
  if (!systems_) return;
  for (const DeviceTable* table :
       {&systems_->systems, &systems_->chunks, &systems_->springs, &systems_->incidences, &systems_->lists})
    table->recordUpload(recorder);
  recorder.fill(state_.stretches, 0, state_.stretches.bytes());
  if (systems_->stretched) systems_->stretched->recordTables(recorder);
  recorder.barrier();
  for (std::uint32_t size = 0; size < kFirstMark; size += kSize)
    recorder.fill(state_.stretches, 1, (kSize - 1) * sizeof(std::uint32_t),
                  (size + 1) * sizeof(std::uint32_t));
  // Springs that ACAD does not prepare have no weight.
  for (const Buffer* buffer : {&systems_->along, &systems_->vectors, &systems_->actives})
    recorder.fill(*buffer, 0, buffer->bytes());
}

void SolveStage::Systems::recordPrepare(vulkan::Recorder& recorder, const Group& group, std::uint32_t from,
                                        std::uint32_t round, double h) const {
  const SolveGroup& on = group.on;
  const shared::PreparePush push{.nodes = nodes,
                                 .firstChunk = on.firstChunk,
                                 .chunks = on.endChunk - on.firstChunk,
                                 .smallSystems = on.smallSystems,
                                 .firstLargeChunk = on.firstLargeChunk,
                                 .largeChunks = on.endChunk - on.firstLargeChunk,
                                 .firstGroup = group.firstSizeOf(round),
                                 .substepSeconds = static_cast<float>(h),
                                 .substepRate = static_cast<float>(1 / h),
                                 .firstSpring = on.firstSpring,
                                 .endSpring = on.endSpring,
                                 .round = round};
  const std::uint64_t all = std::uint64_t{push.chunks} * cut.workgroup;
  recorder.barrier();
  if (on.mesh) {
    recorder.dispatch(group.springs[from], push, on.endSpring - on.firstSpring);
    recorder.barrier();
  }
  if (group.check.empty()) {
    recorder.dispatch(group.prepare[from], push, all,
                      workPerInvocation(kChunkNodes * kPrepareWork, cut.workgroup));
    return;
  }
  constexpr std::size_t kBytes = sizeof(std::uint32_t);
  if (round == 0)
    recorder.dispatchIndirect(group.check[from], push, stretches,
                              firstStretchSize(followOf(on.acadMode)) * kBytes, all);
  else
    recorder.dispatchIndirect(group.check[from], push, groupSizes,
                              (group.firstSizeOf(round - 1) + kNextRound) * kBytes, all);
  recorder.barrier();
  if (round == 0) recorder.fill(stretches, 0, kBytes, firstStretchSize(followOf(on.acadMode)) * kBytes);
  recorder.dispatchIndirect(group.prepare[from], push, groupSizes, group.firstSizeOf(round) * kBytes,
                            all * kPrepareWork);
}

void SolveStage::Systems::recordSmall(vulkan::Recorder& recorder, const Group& group, std::uint32_t from,
                                      std::uint32_t round) const {
  if (group.on.smallSystems == 0) return;
  for (std::uint32_t first = 0; first < group.on.iterations;) {
    const std::uint32_t end = first + std::min(group.iterationsPerDispatch, group.on.iterations - first);
    const shared::SolvePush push{.nodes = nodes,
                                 .firstSystem = group.on.firstSystem,
                                 .firstIteration = first,
                                 .endIteration = end,
                                 .firstChunk = 0,
                                 .nextGroup = 0};
    const std::uint64_t threads = std::uint64_t{group.on.smallSystems} * cut.iterationWorkgroup;
    const std::uint64_t work = workPerInvocation(
        std::uint64_t{group.on.smallChunks} * kChunkNodes * (end - first), cut.iterationWorkgroup);
    recorder.barrier();
    // ACAD may have nothing to solve. Indirect dispatches cannot be divided.
    if (isAdaptive(group.on) && !recorder.divides(group.whole[from], threads, work))
      recorder.dispatchIndirect(group.whole[from], push, groupSizes,
                                (group.firstSizeOf(round) + kSmallSystems) * sizeof(std::uint32_t),
                                threads * work);
    else
      recorder.dispatch(group.whole[from], push, threads, work);
    first = end;
  }
}

void SolveStage::Systems::recordLarge(vulkan::Recorder& recorder, const Group& group, std::uint32_t from,
                                      std::uint32_t round) const {
  const SolveGroup& on = group.on;
  if (!on.hasLarge()) return;
  const auto number = [&](std::uint32_t iteration) {
    return group.firstSizeOf(round) + kIteration + kSize * iteration;
  };
  const std::uint64_t most = std::uint64_t{on.endChunk - on.firstLargeChunk} * cut.iterationWorkgroup;
  shared::SolvePush push{.nodes = nodes,
                         .firstSystem = 0,
                         .firstIteration = 0,
                         .endIteration = 0,
                         .firstChunk = on.firstLargeChunk,
                         .nextGroup = 0};
  // A GPU waits longer for the size of a dispatch than for workgroups that find nothing to do.
  const bool direct = cut.spread && !isAdaptive(on);
  const auto dispatch = [&](const Bindings& bindings) {
    recorder.barrier();
    if (direct)
      recorder.dispatch(bindings, push, most);
    else
      recorder.dispatchIndirect(bindings, push, groupSizes,
                                number(push.firstIteration) * sizeof(std::uint32_t), most);
  };
  for (std::uint32_t iteration = 0; iteration < on.iterations; ++iteration) {
    push.firstIteration = iteration;
    push.nextGroup = number(iteration + 1);
    dispatch(group.multiply[from]);
    dispatch(group.update[from]);
  }
  push.firstIteration = on.iterations;
  dispatch(group.measure[from]);
}

void SolveStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  if (!systems_) return;
  const Systems& all = *systems_;
  const std::uint32_t from = substep.from;
  const shared::CollisionPush& collision = substep.collision;
  const double substepSeconds = substep.tick.substepSeconds;
  recorder.barrier();
  // Without springs to hold, systems of stretched springs need nothing; only the report reads their records.
  if (!all.onlyStretched) recorder.copy(all.emptyGroups, all.groupSizes, all.groupSizes.bytes());
  bool barred = all.onlyStretched && !substep.isLast();
  if (!barred) recorder.fill(all.solves, 0, all.solves.bytes());
  for (const Systems::Group& group : all.groups) {
    if (group.on.stretched) {
      if (!barred) recorder.barrier();
      barred = false;
      const bool collides = collision.colliderCount > 0;
      all.stretched->record(recorder, group.on, from, collides, substepSeconds);
      if (collides) all.recordApply(recorder, group, from, 0, collision, substepSeconds);
      continue;
    }
    barred = false;
    const std::uint32_t rounds = roundsOf(group.on);
    for (std::uint32_t round = 0; round < rounds; ++round) {
      if (round > 0) {
        recorder.barrier();
        recorder.fill(all.solves, 0,
                      (group.on.endSystem - group.on.firstSystem) * sizeof(shared::SolveRecord),
                      group.on.firstSystem * sizeof(shared::SolveRecord));
      }
      all.recordPrepare(recorder, group, from, round, substepSeconds);
      all.recordSmall(recorder, group, from, round);
      all.recordLarge(recorder, group, from, round);
      all.recordApply(recorder, group, from, round, collision, substepSeconds);
    }
  }
}

void SolveStage::Systems::recordApply(vulkan::Recorder& recorder, const Group& group, std::uint32_t from,
                                      std::uint32_t round, const shared::CollisionPush& collision,
                                      double h) const {
  const SolveGroup& on = group.on;
  const bool collides = collision.colliderCount > 0 && (on.stretched || round + 1 == roundsOf(on));
  // Nodes that ACAD leaves alone stay in place, unless they may collide.
  const bool listed = isAdaptive(on) && !collides;
  const shared::ApplyPush push{.collision = collides ? collision : shared::CollisionPush{},
                               .nodes = nodes,
                               .firstChunk = on.firstChunk,
                               .substepSeconds = static_cast<float>(h),
                               .firstGroup = group.firstSizeOf(round),
                               .listed = listed ? 1u : 0u,
                               .reserved0 = 0,
                               .reserved1 = 0,
                               .reserved2 = 0};
  recorder.barrier();
  const std::uint64_t threads = std::uint64_t{on.endChunk - on.firstChunk} * cut.workgroup;
  if (listed)
    recorder.dispatchIndirect(group.apply[from], push, groupSizes,
                              group.firstSizeOf(round) * sizeof(std::uint32_t), threads);
  else
    recorder.dispatch(group.apply[from], push, threads,
                      workPerInvocation(std::uint64_t{kChunkNodes} * collision.nodeWork, cut.workgroup));
}

std::uint32_t SolveStage::stretchGroups(Follow follow) const {
  if (!active()) return 0;
  for (const Systems::Group& group : systems_->groups) {
    const SolveGroup& on = group.on;
    if (isAdaptive(on) && !on.mesh && followOf(on.acadMode) == follow)
      return on.stretched ? on.endSystem - on.firstSystem : on.endChunk - on.firstChunk;
  }
  return 0;
}

void SolveStage::recordReport(vulkan::Recorder& recorder, const Tick&) {
  if (!systems_) return;
  recorder.copy(systems_->solves, systems_->solvesReadback, systems_->solves.bytes());
}

std::span<const shared::SolveRecord> SolveStage::report() const {
  if (!systems_) return {};
  return systems_->solvesReadback.mapped<const shared::SolveRecord>();
}

void SolveStage::recordActiveSprings(vulkan::Recorder& recorder) {
  Systems& all = *systems_;
  if (!all.marked && all.named.groups.empty()) return;
  if (!all.marked)
    all.marked = std::make_unique<ActiveSprings>(
        device_, std::move(all.named),
        ActiveSprings::Buffers{state_.cloths, all.systems.texels(), all.chunks.texels(), all.solves,
                               all.along, all.rows, all.vectors, all.stretched.get()},
        all.cut.workgroup);
  all.marked->record(recorder);
}

void SolveStage::activeSprings(std::size_t most, std::span<std::vector<std::uint32_t>> ofCloths) const {
  if (systems_->marked) systems_->marked->collect(most, ofCloths);
}

std::span<const std::uint32_t> SolveStage::cloths() const {
  if (!systems_) return {};
  return systems_->cloths;
}

}  // namespace clothstream::simulation
