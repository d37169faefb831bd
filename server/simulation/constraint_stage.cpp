// SPDX-License-Identifier: MIT
// Implicit constraint enforcement on the device.
#include "server/simulation/constraint_stage.h"

#include <algorithm>
#include <vector>

#include "kernels/apply_constraints.h"
#include "kernels/prepare_constraints.h"
#include "kernels/solve_constraints.h"
#include "server/simulation/device_table.h"
#include "server/simulation/solve_cut.h"

namespace clothstream::simulation {
namespace {

using vulkan::BindingKind;
using vulkan::Bindings;
using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr auto kTexels = BindingKind::texels;
constexpr auto kStorage = BindingKind::storage;

constexpr std::uint32_t kWorkgroup = 64;

SolveRounds roundsOf(const ConstraintTables& tables, std::uint32_t workgroupSize) {
  std::uint32_t texels = 0;
  for (const shared::IncidenceRecord& incidence : tables.incidences)
    texels = std::max(texels, static_cast<std::uint32_t>(incidence.list.z));
  std::uint32_t links = 0, nodes = 0, sum = 0;
  for (const shared::SystemRecord& system : tables.systems) {
    links = std::max(links, roundsOfShare(system.links.z, workgroupSize));
    nodes = std::max(nodes, roundsOfShare(system.nodes.y, workgroupSize));
    sum = std::max(sum, roundsOfSum(system.links.z, workgroupSize));
  }
  const std::uint32_t gather = texels + 2;
  const std::uint32_t list = 2 * sum + CLOTHSTREAM_SOLVE_LANES;
  return {list + sum, std::max(nodes * gather, links / 4 * 2 * gather) + 2 * sum + links};
}

vulkan::Kernel makeSolve(const vulkan::Device& device, std::uint32_t workgroupSize, bool adaptive) {
  return vulkan::Kernel(
      device, {.name = "solve_constraints",
               .spirv = kernels::solve_constraints,
               .bindings = {kTexels, kTexels, kTexels, kTexels, kTexels, kTexels, kTexels, kStorage, kStorage,
                            kStorage, kStorage, kStorage, kStorage, kStorage},
               .pushConstantBytes = sizeof(shared::SolvePush),
               .workgroupSize = workgroupSize,
               .specialisation = {adaptive ? 1u : 0u}});
}

}  // namespace

struct ConstraintStage::Kernels {
  Kernels(const vulkan::Device& device, std::uint32_t solveWorkgroup)
      : prepare(device,
                {.name = "prepare_constraints",
                 .spirv = kernels::prepare_constraints,
                 .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage, kStorage, kStorage, kStorage},
                 .pushConstantBytes = sizeof(shared::ConstraintPush),
                 .workgroupSize = kWorkgroup,
                 .specialisation = {}}),
        solveAll(makeSolve(device, solveWorkgroup, false)),
        solveActive(makeSolve(device, solveWorkgroup, true)),
        apply(device, {.name = "apply_constraints",
                       .spirv = kernels::apply_constraints,
                       .bindings = {kTexels, kTexels, kTexels, kTexels, kTexels, kStorage, kTexels, kTexels,
                                    kTexels, kStorage, kStorage},
                       .pushConstantBytes = sizeof(shared::ConstraintPush),
                       .workgroupSize = kWorkgroup,
                       .specialisation = {}}) {}

  vulkan::Kernel prepare, solveAll, solveActive, apply;
};

// All whose size follows from the constraints, and what binds it.
struct ConstraintStage::Systems {
  Systems(const vulkan::Device& device, const ConstraintTables& tables, const StateBuffers& state,
          const Kernels& kernels, const SolveCut& solveCut)
      : linkCount(static_cast<std::uint32_t>(tables.links.size())),
        nodeCount(static_cast<std::uint32_t>(tables.incidences.size())),
        systemCount(static_cast<std::uint32_t>(tables.systems.size())),
        alwaysCount(tables.always),
        cut(solveCut),
        systems(device, tables.systems),
        links(device, tables.links),
        incidences(device, tables.incidences),
        lists(device, tables.lists),
        rows(device, BufferPurpose::texels, linkCount * sizeof(shared::vec4)),
        multipliers(device, BufferPurpose::state, linkCount * sizeof(float)),
        residuals(device, BufferPurpose::state, linkCount * sizeof(float)),
        directions(device, BufferPurpose::state, linkCount * sizeof(float)),
        products(device, BufferPurpose::state, linkCount * sizeof(float)),
        moves(device, BufferPurpose::state, nodeCount * sizeof(shared::vec4)),
        actives(device, BufferPurpose::state, linkCount * sizeof(std::uint32_t)),
        solves(device, BufferPurpose::state, systemCount * sizeof(shared::SolveRecord)),
        solvesReadback(device, BufferPurpose::readback, systemCount * sizeof(shared::SolveRecord)),
        prepareFrom{bindPrepare(device, kernels.prepare, state, 0),
                    bindPrepare(device, kernels.prepare, state, 1)},
        solveAll(bindSolve(device, kernels.solveAll, state)),
        solveActive(bindSolve(device, kernels.solveActive, state)),
        applyTo{bindApply(device, kernels.apply, state, 0), bindApply(device, kernels.apply, state, 1)} {
    for (const shared::SystemRecord& system : tables.systems)
      cloths.push_back(static_cast<std::uint32_t>(system.links.w));
  }

  Bindings bindPrepare(const vulkan::Device& device, const vulkan::Kernel& kernel, const StateBuffers& state,
                       std::size_t from) const {
    return Bindings(device, kernel,
                    {&links.texels(), state.positions[from], state.velocities[1 - from], &state.cloths, &rows,
                     &multipliers, &residuals, &directions});
  }
  Bindings bindSolve(const vulkan::Device& device, const vulkan::Kernel& kernel,
                     const StateBuffers& state) const {
    return Bindings(
        device, kernel,
        {&state.cloths, &systems.texels(), &incidences.texels(), &lists.texels(), &rows, &links.texels(),
         state.positions[0], &multipliers, &residuals, &directions, &products, &moves, &actives, &solves});
  }
  Bindings bindApply(const vulkan::Device& device, const vulkan::Kernel& kernel, const StateBuffers& state,
                     std::size_t to) const {
    return Bindings(device, kernel,
                    {&state.cloths, &systems.texels(), &incidences.texels(), &lists.texels(), &rows,
                     &multipliers, &state.colliders, &state.nearColliders, state.positions[1 - to],
                     state.positions[to], state.velocities[to]});
  }

  std::uint32_t linkCount, nodeCount, systemCount, alwaysCount;
  SolveCut cut;
  std::vector<std::uint32_t> cloths;
  DeviceTable systems, links, incidences, lists;
  Buffer rows, multipliers, residuals, directions, products, moves, actives, solves, solvesReadback;
  std::array<Bindings, 2> prepareFrom;
  Bindings solveAll, solveActive;
  std::array<Bindings, 2> applyTo;
};

ConstraintStage::ConstraintStage(const vulkan::Device& device, const ConstraintTables& tables,
                                 const StateBuffers& state, std::uint32_t workgroupSize)
    : device_(device), state_(state), workgroupSize_(workgroupSize) {
  makeTables(tables);
  takeTables();
}

ConstraintStage::~ConstraintStage() = default;

void ConstraintStage::makeTables(const ConstraintTables& tables) {
  nextSystems_.reset();
  nextKernels_.reset();
  if (tables.links.empty()) return;
  const SolveCut cut = cutSolve(device_, workgroupSize_, "a cloth of that many constraints",
                                [&](std::uint32_t size) { return roundsOf(tables, size); });
  if (!kernels_ || kernels_->solveAll.workgroupSize() != cut.workgroupSize)
    nextKernels_ = std::make_unique<Kernels>(device_, cut.workgroupSize);
  nextSystems_ =
      std::make_unique<Systems>(device_, tables, state_, nextKernels_ ? *nextKernels_ : *kernels_, cut);
}

void ConstraintStage::takeTables() {
  systems_ = std::move(nextSystems_);
  if (nextKernels_) kernels_ = std::move(nextKernels_);
}

void ConstraintStage::recordTables(vulkan::Recorder& recorder) const {
  for (const DeviceTable* table :
       {&systems_->systems, &systems_->links, &systems_->incidences, &systems_->lists})
    table->recordUpload(recorder);
}

void ConstraintStage::record(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t iterations,
                             shared::ConstraintPush push) const {
  const Systems& on = *systems_;
  push.count = on.linkCount;
  recorder.barrier();
  recorder.dispatch(on.prepareFrom[from], push, on.linkCount);
  recordSolve(recorder, on.solveAll, on.cut, 0, on.alwaysCount, iterations);
  recordSolve(recorder, on.solveActive, on.cut, on.alwaysCount, on.systemCount - on.alwaysCount, iterations);
  push.count = on.nodeCount;
  recorder.barrier();
  recorder.dispatch(on.applyTo[1 - from], push, on.nodeCount);
}

void ConstraintStage::recordReport(vulkan::Recorder& recorder) const {
  recorder.copy(systems_->solves, systems_->solvesReadback, systems_->solves.bytes());
}

std::span<const shared::SolveRecord> ConstraintStage::report() const {
  return systems_->solvesReadback.mapped<const shared::SolveRecord>();
}

std::span<const std::uint32_t> ConstraintStage::cloths() const {
  return systems_->cloths;
}

}  // namespace clothstream::simulation
