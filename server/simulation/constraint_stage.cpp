// SPDX-License-Identifier: MIT
// Implicit constraint enforcement on the device.
#include "server/simulation/constraint_stage.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <stdexcept>

#include <fmt/format.h>

#include "kernels/apply_constraints.h"
#include "kernels/prepare_constraints.h"
#include "kernels/solve_constraints.h"

namespace clothstream::simulation {
namespace {

using vulkan::BindingKind;
using vulkan::Bindings;
using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr auto kTexels = BindingKind::texels;
constexpr auto kStorage = BindingKind::storage;

constexpr std::uint32_t kWorkgroup = 64;

// lavapipe lets an invocation make this many rounds of loops, all loops together, and then ends each after
// one.
constexpr std::uint32_t kSoftwareRounds = 65'535;

// Rounds of loops of one invocation in the largest system: of the solve's beginning and end, and of an
// iteration.
struct Rounds {
  std::uint32_t fixed, iteration;
};
Rounds roundsOf(const ConstraintTables& tables, std::uint32_t workgroupSize) {
  const auto shares = [&](float count) { return static_cast<std::uint32_t>(count) / workgroupSize + 2; };
  std::uint32_t texels = 0;
  for (const shared::IncidenceRecord& incidence : tables.incidences)
    texels = std::max(texels, static_cast<std::uint32_t>(incidence.list.z));
  std::uint32_t links = 0, nodes = 0;
  for (const shared::SystemRecord& system : tables.systems) {
    links = std::max(links, shares(system.links.z));
    nodes = std::max(nodes, shares(system.nodes.y));
  }
  // Loops round a loop end once more than they work.
  const std::uint32_t lanes = CLOTHSTREAM_SOLVE_LANES / workgroupSize + 2;
  const std::uint32_t sum = links + 2 * lanes + 2 * CLOTHSTREAM_SOLVE_LANES / workgroupSize + 16;
  const std::uint32_t gather = texels + 2;
  const std::uint32_t list = 2 * (links + 2 * lanes) + CLOTHSTREAM_SOLVE_LANES;
  return {list + sum, std::max(nodes * gather, links / 4 * 2 * gather) + 2 * sum + links};
}

// A solve is one workgroup with barriers between its passes: on a software device these cost nothing as long
// as it is no wider than the CPU's vectors, for it then runs without switching between invocations.
SolveCut cutSolve(const vulkan::Device& device, const ConstraintTables& tables, std::uint32_t workgroupSize) {
  SolveCut cut{workgroupSize, ~0u};
  const std::uint32_t most = std::min(256u, device.limits().maxWorkgroupInvocations);
  if (!device.isSoftware()) {
    if (workgroupSize == 0) cut.workgroupSize = most;
    return cut;
  }
  if (workgroupSize == 0) cut.workgroupSize = 8;
  Rounds rounds = roundsOf(tables, cut.workgroupSize);
  while (rounds.fixed + rounds.iteration > kSoftwareRounds) {
    if (cut.workgroupSize >= most)
      throw std::runtime_error(
          fmt::format("a cloth of {} constraints is more than the constraint solver takes on {}",
                      tables.links.size(), device.info().name));
    cut.workgroupSize *= 2;
    rounds = roundsOf(tables, cut.workgroupSize);
  }
  cut.iterationsPerDispatch = (kSoftwareRounds - rounds.fixed) / rounds.iteration;
  return cut;
}

vulkan::Kernel makeSolve(const vulkan::Device& device, const SolveCut& cut, bool adaptive) {
  return vulkan::Kernel(
      device, {.name = "solve_constraints",
               .spirv = kernels::solve_constraints,
               .bindings = {kTexels, kTexels, kTexels, kTexels, kTexels, kTexels, kTexels, kStorage, kStorage,
                            kStorage, kStorage, kStorage, kStorage, kStorage},
               .pushConstantBytes = sizeof(shared::SolvePush),
               .workgroupSize = cut.workgroupSize,
               .specialisation = {adaptive ? 1u : 0u}});
}

template <typename T>
std::span<const std::byte> bytesOf(const std::vector<T>& records) {
  assert(!records.empty());
  return std::as_bytes(std::span(records));
}

}  // namespace

ConstraintStage::Table::Table(const vulkan::Device& device, std::span<const std::byte> bytes)
    : upload(device, BufferPurpose::upload, bytes.size()),
      texels(device, BufferPurpose::texels, bytes.size()) {
  std::memcpy(upload.mapped().data(), bytes.data(), bytes.size());
}

ConstraintStage::ConstraintStage(const vulkan::Device& device, const ConstraintTables& tables,
                                 const StateBuffers& state, std::uint32_t workgroupSize)
    : linkCount_(static_cast<std::uint32_t>(tables.links.size())),
      nodeCount_(static_cast<std::uint32_t>(tables.incidences.size())),
      systemCount_(static_cast<std::uint32_t>(tables.systems.size())),
      alwaysCount_(tables.always),
      cut_(cutSolve(device, tables, workgroupSize)),
      systems_(device, bytesOf(tables.systems)),
      links_(device, bytesOf(tables.links)),
      incidences_(device, bytesOf(tables.incidences)),
      lists_(device, bytesOf(tables.lists)),
      rows_(device, BufferPurpose::texels, linkCount_ * sizeof(shared::vec4)),
      multipliers_(device, BufferPurpose::state, linkCount_ * sizeof(float)),
      residuals_(device, BufferPurpose::state, linkCount_ * sizeof(float)),
      directions_(device, BufferPurpose::state, linkCount_ * sizeof(float)),
      products_(device, BufferPurpose::state, linkCount_ * sizeof(float)),
      moves_(device, BufferPurpose::state, nodeCount_ * sizeof(shared::vec4)),
      actives_(device, BufferPurpose::state, linkCount_ * sizeof(std::uint32_t)),
      solves_(device, BufferPurpose::state, systemCount_ * sizeof(shared::SolveRecord)),
      solvesReadback_(device, BufferPurpose::readback, systemCount_ * sizeof(shared::SolveRecord)),
      prepare_(device,
               {.name = "prepare_constraints",
                .spirv = kernels::prepare_constraints,
                .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage, kStorage, kStorage, kStorage},
                .pushConstantBytes = sizeof(shared::ConstraintPush),
                .workgroupSize = kWorkgroup,
                .specialisation = {}}),
      solveAll_(makeSolve(device, cut_, false)),
      solveActive_(makeSolve(device, cut_, true)),
      apply_(device, {.name = "apply_constraints",
                      .spirv = kernels::apply_constraints,
                      .bindings = {kTexels, kTexels, kTexels, kTexels, kTexels, kStorage, kTexels, kTexels,
                                   kTexels, kStorage, kStorage},
                      .pushConstantBytes = sizeof(shared::ConstraintPush),
                      .workgroupSize = kWorkgroup,
                      .specialisation = {}}),
      prepareFrom_{prepareFrom(device, state, 0), prepareFrom(device, state, 1)},
      solveAllBindings_(solveBindings(device, solveAll_, state)),
      solveActiveBindings_(solveBindings(device, solveActive_, state)),
      applyTo_{applyTo(device, state, 0), applyTo(device, state, 1)} {}

Bindings ConstraintStage::prepareFrom(const vulkan::Device& device, const StateBuffers& state,
                                      std::size_t from) const {
  return Bindings(device, prepare_,
                  {&links_.texels, state.positions[from], state.velocities[1 - from], &state.cloths, &rows_,
                   &multipliers_, &residuals_, &directions_});
}

Bindings ConstraintStage::solveBindings(const vulkan::Device& device, const vulkan::Kernel& kernel,
                                        const StateBuffers& state) const {
  return Bindings(device, kernel,
                  {&state.cloths, &systems_.texels, &incidences_.texels, &lists_.texels, &rows_,
                   &links_.texels, state.positions[0], &multipliers_, &residuals_, &directions_, &products_,
                   &moves_, &actives_, &solves_});
}

Bindings ConstraintStage::applyTo(const vulkan::Device& device, const StateBuffers& state,
                                  std::size_t to) const {
  return Bindings(device, apply_,
                  {&state.cloths, &systems_.texels, &incidences_.texels, &lists_.texels, &rows_,
                   &multipliers_, &state.colliders, &state.nearColliders, state.positions[1 - to],
                   state.positions[to], state.velocities[to]});
}

void ConstraintStage::recordTables(vulkan::Recorder& recorder) const {
  for (const Table* table : {&systems_, &links_, &incidences_, &lists_})
    recorder.copy(table->upload, table->texels, table->upload.bytes());
}

void ConstraintStage::record(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t iterations,
                             shared::ConstraintPush push) const {
  push.count = linkCount_;
  recorder.barrier();
  recorder.dispatch(prepareFrom_[from], push, linkCount_);
  recordSolve(recorder, solveAllBindings_, 0, alwaysCount_, iterations);
  recordSolve(recorder, solveActiveBindings_, alwaysCount_, systemCount_ - alwaysCount_, iterations);
  push.count = nodeCount_;
  recorder.barrier();
  recorder.dispatch(applyTo_[1 - from], push, nodeCount_);
}

void ConstraintStage::recordSolve(vulkan::Recorder& recorder, const Bindings& bindings,
                                  std::uint32_t firstSystem, std::uint32_t systems,
                                  std::uint32_t iterations) const {
  if (systems == 0) return;
  for (std::uint32_t first = 0; first < iterations;) {
    const std::uint32_t end = first + std::min(cut_.iterationsPerDispatch, iterations - first);
    recorder.barrier();
    recorder.dispatch(bindings, shared::SolvePush{first, end, firstSystem},
                      std::uint64_t{systems} * cut_.workgroupSize);
    first = end;
  }
}

void ConstraintStage::recordReport(vulkan::Recorder& recorder) const {
  recorder.copy(solves_, solvesReadback_, solves_.bytes());
}

std::span<const shared::SolveRecord> ConstraintStage::report() const {
  return solvesReadback_.mapped<const shared::SolveRecord>();
}

}  // namespace clothstream::simulation
