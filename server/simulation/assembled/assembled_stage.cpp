// SPDX-License-Identifier: MIT
// Constraint enforcement on the device with assembled matrices.
#include "server/simulation/assembled/assembled_stage.h"

#include <algorithm>
#include <bit>
#include <vector>

#include "kernels/apply_multipliers.h"
#include "kernels/fill_jacobian.h"
#include "kernels/multiply_jacobians.h"
#include "kernels/multiply_system.h"
#include "kernels/solve_multipliers.h"
#include "kernels/update_multipliers.h"
#include "server/simulation/workgroup_work.h"

namespace clothstream::simulation {
namespace {

using vulkan::BufferPurpose;

// On a software device a workgroup is no wider than the CPU's vectors, and an invocation makes at most 65,535
// loop rounds; compare SolveStage.
AssembledCut cutAssembled(const vulkan::Device& device, std::uint32_t workgroupSize,
                          std::optional<std::uint32_t> wholeNodes) {
  constexpr std::uint32_t kLanes = CLOTHSTREAM_SOLVE_LANES;
  if (workgroupSize == 0) workgroupSize = device.hasGpuKernels() ? kLanes : 8;
  return {
      .workgroup = std::bit_floor(std::min({workgroupSize, kLanes, device.limits().maxWorkgroupInvocations})),
      .wholeNodes = wholeNodes.value_or(device.hasGpuKernels() ? 1024 : 4096),
      .rounds = device.isSoftware() ? 65'000 : ~0u};
}

// Loop rounds of a solve that take as long as one unit of work.
constexpr std::uint32_t kRoundsPerWork = 4;
// Work of a row of J (vulkan::Recorder::dispatch) when the matrices are filled.
constexpr std::uint32_t kFillWork = 8;

// Bindings need a buffer even for an empty table.
std::size_t texels(std::size_t count) {
  return std::max<std::size_t>(1, count) * sizeof(shared::vec4);
}

}  // namespace

bool AssembledStage::isIn(std::span<const model::Cloth> cloths) {
  return std::ranges::any_of(cloths, [](const model::Cloth& cloth) { return isAssembled(cloth.solver); });
}

AssembledStage::AssembledStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                               const StateBuffers& state, std::uint32_t workgroupSize,
                               std::optional<std::uint32_t> wholeNodes)
    : cut_(cutAssembled(device, workgroupSize, wholeNodes)),
      tables_(assembledTables(cloths, cut_)),
      systems_(device, tables_.systems),
      chunks_(device, tables_.chunks),
      rows_(device, tables_.rows),
      entries_(device, tables_.entries),
      columns_(device, tables_.columns),
      sources_(device, tables_.sources),
      nodeEntries_(device, tables_.nodeEntries),
      nodeRows_(device, tables_.nodeRows),
      nodeRanges_(device, tables_.nodeRanges),
      blocks_(device, BufferPurpose::texels, texels(2 * tables_.rows.size())),
      values_(device, BufferPurpose::texels, texels(tables_.columns.size())),
      vectors_(device, BufferPurpose::texels, texels(2 * tables_.rows.size())),
      sums_(device, BufferPurpose::state, tables_.chunks.size() * 2 * sizeof(float)),
      solves_(device, BufferPurpose::state, tables_.systems.size() * sizeof(shared::SolveRecord)),
      solvesReadback_(device, BufferPurpose::readback, solves_.bytes()),
      fill_(bindStates(device, {device, kernels::fill_jacobian, cut_.workgroup},
                       [&](std::size_t from) {
                         return BufferList{&state.cloths,
                                           &systems_.texels(),
                                           &chunks_.texels(),
                                           &rows_.texels(),
                                           state.positions[from],
                                           state.velocities[1 - from],
                                           &blocks_,
                                           &vectors_,
                                           &solves_};
                       })),
      multiplyJacobians_(device, {device, kernels::multiply_jacobians, cut_.workgroup},
                         {&state.cloths, &systems_.texels(), &chunks_.texels(), &entries_.texels(),
                          &columns_.texels(), &sources_.texels(), &blocks_, &values_}),
      apply_(bindStates(device, {device, kernels::apply_multipliers, cut_.workgroup}, [&](std::size_t from) {
        const std::size_t to = 1 - from;
        return BufferList{&state.cloths,          &nodeRanges_.texels(),
                          &nodeEntries_.texels(), &nodeRows_.texels(),
                          &state.colliders,       &state.nearColliders,
                          state.positions[from],  state.positions[to],
                          state.velocities[to],   &blocks_,
                          &state.contactImpulses, &vectors_};
      })) {
  const auto make = [&](const vulkan::KernelCode& code) {
    return vulkan::Bindings(device, {device, code, cut_.workgroup},
                            {&state.cloths, &systems_.texels(), &chunks_.texels(), &entries_.texels(),
                             &columns_.texels(), &values_, &vectors_, &vectors_, &sums_, &solves_});
  };
  if (tables_.wholeSystems.count > 0) solve_ = make(kernels::solve_multipliers);
  if (tables_.partChunks.count > 0) {
    multiply_ = make(kernels::multiply_system);
    update_ = make(kernels::update_multipliers);
  }
  // The largest tables by far; only the device still needs them.
  for (std::vector<shared::NumbersRecord>* table : {&tables_.columns, &tables_.sources}) {
    table->clear();
    table->shrink_to_fit();
  }
}

void AssembledStage::recordTables(vulkan::Recorder& recorder) {
  for (const DeviceTable* table : {&systems_, &chunks_, &rows_, &entries_, &columns_, &sources_,
                                   &nodeEntries_, &nodeRows_, &nodeRanges_})
    table->recordUpload(recorder);
}

// Records as many dispatches as the device's limit on loop rounds requires.
void AssembledStage::recordWhole(vulkan::Recorder& recorder, bool measures) const {
  if (!solve_) return;
  shared::MultiplierPush push{};
  push.rows = static_cast<std::uint32_t>(tables_.rows.size());
  const std::uint32_t each = cut_.rounds / tables_.wholeRounds - 1;
  while (push.firstIteration < tables_.wholeIterations) {
    push.endIteration = push.firstIteration + std::min(each, tables_.wholeIterations - push.firstIteration);
    push.measures = measures && push.endIteration == tables_.wholeIterations ? 1 : 0;
    const std::uint64_t rounds =
        std::uint64_t{tables_.wholeRounds} * (push.endIteration - push.firstIteration);
    recorder.barrier();
    recorder.dispatch(*solve_, push, std::uint64_t{tables_.wholeSystems.count} * cut_.workgroup,
                      rounds / kRoundsPerWork + 1);
    push.firstIteration = push.endIteration;
  }
}

void AssembledStage::recordParts(vulkan::Recorder& recorder, bool measures) const {
  if (!multiply_) return;
  shared::MultiplierPush push{};
  push.rows = static_cast<std::uint32_t>(tables_.rows.size());
  push.firstChunk = tables_.partChunks.first;
  const std::uint64_t threads = std::uint64_t{tables_.partChunks.count} * cut_.workgroup;
  for (std::uint32_t iteration = 0; iteration < tables_.partIterations; ++iteration)
    for (const vulkan::Bindings* half : {&*multiply_, &*update_}) {
      recorder.barrier();
      recorder.dispatch(*half, push, threads);
    }
  if (!measures) return;
  push.measures = 1;
  recorder.barrier();
  recorder.dispatch(*multiply_, push, threads);
}

void AssembledStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const std::uint64_t chunkThreads = std::uint64_t{tables_.chunks.size()} * cut_.workgroup;
  recorder.barrier();
  recorder.dispatch(fill_[substep.from],
                    shared::AssemblePush{static_cast<float>(1 / substep.tick.substepSeconds)}, chunkThreads,
                    workPerInvocation(CLOTHSTREAM_ASSEMBLED_CHUNK_ROWS * kFillWork, cut_.workgroup));
  recorder.barrier();
  recorder.dispatch(multiplyJacobians_, chunkThreads);
  recordWhole(recorder, substep.isLast());
  recordParts(recorder, substep.isLast());
  recorder.barrier();
  recorder.dispatch(
      apply_[substep.from],
      shared::ApplyMultiplierPush{.collision = substep.collision,
                                  .substepSeconds = static_cast<float>(substep.tick.substepSeconds),
                                  .reserved0 = 0,
                                  .reserved1 = 0,
                                  .reserved2 = 0},
      std::uint64_t{tables_.nodeRanges.size()} * cut_.workgroup, substep.collision.nodeWork);
}

void AssembledStage::recordReport(vulkan::Recorder& recorder, const Tick&) {
  recorder.copy(solves_, solvesReadback_, solves_.bytes());
}

std::span<const shared::SolveRecord> AssembledStage::report() const {
  return solvesReadback_.mapped<const shared::SolveRecord>();
}

}  // namespace clothstream::simulation
