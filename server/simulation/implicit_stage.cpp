// SPDX-License-Identifier: MIT
// Implicit Euler on the device.
#include "server/simulation/implicit_stage.h"

#include <algorithm>
#include <array>
#include <vector>

#include "kernels/apply_velocities.h"
#include "kernels/prepare_springs.h"
#include "kernels/solve_velocities.h"
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

SolveRounds roundsOf(const ImplicitTables& tables, std::uint32_t workgroupSize) {
  std::uint32_t texels = 0;
  for (const shared::IncidenceRecord& incidence : tables.incidences)
    texels = std::max(texels, static_cast<std::uint32_t>(incidence.list.z));
  std::uint32_t nodes = 0, sum = 0;
  for (const shared::SystemRecord& system : tables.systems) {
    nodes = std::max(nodes, roundsOfShare(system.nodes.y, workgroupSize));
    sum = std::max(sum, roundsOfSum(system.nodes.y, workgroupSize));
  }
  const std::uint32_t gather = 3 * (texels + 1) + 1;  // with the two springs of each texel
  return {sum + nodes * gather, sum + nodes * gather + sum + nodes};
}

}  // namespace

struct ImplicitStage::Kernels {
  Kernels(const vulkan::Device& device, std::uint32_t solveWorkgroup)
      : prepare(device, {.name = "prepare_springs",
                         .spirv = kernels::prepare_springs,
                         .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage, kStorage},
                         .pushConstantBytes = sizeof(shared::ConstraintPush),
                         .workgroupSize = kWorkgroup,
                         .specialisation = {}}),
        solve(device, {.name = "solve_velocities",
                       .spirv = kernels::solve_velocities,
                       .bindings = {kTexels, kTexels, kTexels, kTexels, kTexels, kTexels, kTexels, kTexels,
                                    kTexels, kStorage, kStorage, kStorage, kStorage, kStorage},
                       .pushConstantBytes = sizeof(shared::SolvePush),
                       .workgroupSize = solveWorkgroup,
                       .specialisation = {}}),
        apply(device, {.name = "apply_velocities",
                       .spirv = kernels::apply_velocities,
                       .bindings = {kTexels, kTexels, kTexels, kTexels, kTexels, kStorage, kTexels, kTexels,
                                    kTexels, kStorage, kStorage},
                       .pushConstantBytes = sizeof(shared::ConstraintPush),
                       .workgroupSize = kWorkgroup,
                       .specialisation = {}}) {}

  vulkan::Kernel prepare, solve, apply;
};

// All whose size follows from the cloths, and what binds it.
struct ImplicitStage::Systems {
  Systems(const vulkan::Device& device, const ImplicitTables& tables, const StateBuffers& state,
          const Kernels& kernels, const SolveCut& solveCut)
      : springCount(static_cast<std::uint32_t>(tables.springs.size())),
        nodeCount(static_cast<std::uint32_t>(tables.incidences.size())),
        systemCount(static_cast<std::uint32_t>(tables.systems.size())),
        cut(solveCut),
        systems(device, tables.systems),
        springs(device, tables.springs),
        incidences(device, tables.incidences),
        lists(device, tables.lists),
        rows(device, BufferPurpose::texels, springCount * sizeof(shared::vec4)),
        impulses(device, BufferPurpose::texels, springCount * sizeof(shared::vec4)),
        corrections(device, BufferPurpose::state, nodeCount * sizeof(shared::vec4)),
        residuals(device, BufferPurpose::state, nodeCount * sizeof(shared::vec4)),
        directions(device, BufferPurpose::state, nodeCount * sizeof(shared::vec4)),
        products(device, BufferPurpose::state, nodeCount * sizeof(shared::vec4)),
        solves(device, BufferPurpose::state, systemCount * sizeof(shared::SolveRecord)),
        solvesReadback(device, BufferPurpose::readback, systemCount * sizeof(shared::SolveRecord)),
        prepareFrom{bindPrepare(device, kernels.prepare, state, 0),
                    bindPrepare(device, kernels.prepare, state, 1)},
        solveFrom{bindSolve(device, kernels.solve, state, 0), bindSolve(device, kernels.solve, state, 1)},
        applyTo{bindApply(device, kernels.apply, state, 0), bindApply(device, kernels.apply, state, 1)} {
    for (const shared::SystemRecord& system : tables.systems)
      cloths.push_back(static_cast<std::uint32_t>(system.links.w));
  }

  Bindings bindPrepare(const vulkan::Device& device, const vulkan::Kernel& kernel, const StateBuffers& state,
                       std::size_t from) const {
    return Bindings(
        device, kernel,
        {&springs.texels(), state.positions[from], state.velocities[from], &state.cloths, &rows, &impulses});
  }
  Bindings bindSolve(const vulkan::Device& device, const vulkan::Kernel& kernel, const StateBuffers& state,
                     std::size_t from) const {
    return Bindings(device, kernel,
                    {&state.cloths, &systems.texels(), &incidences.texels(), &lists.texels(), &rows,
                     &impulses, state.positions[from], state.velocities[from], state.velocities[1 - from],
                     &corrections, &residuals, &directions, &products, &solves});
  }
  Bindings bindApply(const vulkan::Device& device, const vulkan::Kernel& kernel, const StateBuffers& state,
                     std::size_t to) const {
    return Bindings(device, kernel,
                    {&state.cloths, &systems.texels(), &incidences.texels(), &lists.texels(), &rows,
                     &corrections, &state.colliders, &state.nearColliders, state.positions[1 - to],
                     state.positions[to], state.velocities[to]});
  }

  std::uint32_t springCount, nodeCount, systemCount;
  SolveCut cut;
  std::vector<std::uint32_t> cloths;
  DeviceTable systems, springs, incidences, lists;
  Buffer rows, impulses, corrections, residuals, directions, products, solves, solvesReadback;
  std::array<Bindings, 2> prepareFrom, solveFrom, applyTo;
};

ImplicitStage::ImplicitStage(const vulkan::Device& device, const ImplicitTables& tables,
                             const StateBuffers& state, std::uint32_t workgroupSize)
    : device_(device), state_(state), workgroupSize_(workgroupSize) {
  makeTables(tables);
  takeTables();
}

ImplicitStage::~ImplicitStage() = default;

void ImplicitStage::makeTables(const ImplicitTables& tables) {
  nextSystems_.reset();
  nextKernels_.reset();
  if (tables.springs.empty()) return;
  const SolveCut cut = cutSolve(device_, workgroupSize_, "an implicit cloth of that many nodes",
                                [&](std::uint32_t size) { return roundsOf(tables, size); });
  if (!kernels_ || kernels_->solve.workgroupSize() != cut.workgroupSize)
    nextKernels_ = std::make_unique<Kernels>(device_, cut.workgroupSize);
  nextSystems_ =
      std::make_unique<Systems>(device_, tables, state_, nextKernels_ ? *nextKernels_ : *kernels_, cut);
}

void ImplicitStage::takeTables() {
  systems_ = std::move(nextSystems_);
  if (nextKernels_) kernels_ = std::move(nextKernels_);
}

void ImplicitStage::recordTables(vulkan::Recorder& recorder) const {
  for (const DeviceTable* table :
       {&systems_->systems, &systems_->springs, &systems_->incidences, &systems_->lists})
    table->recordUpload(recorder);
}

void ImplicitStage::record(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t iterations,
                           shared::ConstraintPush push) const {
  const Systems& on = *systems_;
  push.count = on.springCount;
  recorder.barrier();
  recorder.dispatch(on.prepareFrom[from], push, on.springCount);
  recordSolve(recorder, on.solveFrom[from], on.cut, 0, on.systemCount, iterations);
  push.count = on.nodeCount;
  recorder.barrier();
  recorder.dispatch(on.applyTo[1 - from], push, on.nodeCount);
}

void ImplicitStage::recordReport(vulkan::Recorder& recorder) const {
  recorder.copy(systems_->solves, systems_->solvesReadback, systems_->solves.bytes());
}

std::span<const shared::SolveRecord> ImplicitStage::report() const {
  return systems_->solvesReadback.mapped<const shared::SolveRecord>();
}

std::span<const std::uint32_t> ImplicitStage::cloths() const {
  return systems_->cloths;
}

}  // namespace clothstream::simulation
