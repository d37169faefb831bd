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

// How a solve is cut; the results do not depend on it.
struct SolveCut {
  std::uint32_t workgroupSize;
  std::uint32_t iterationsPerDispatch;
};

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

template <typename T>
std::span<const std::byte> bytesOf(const std::vector<T>& records) {
  assert(!records.empty());
  return std::as_bytes(std::span(records));
}

struct Table {
  Table(const vulkan::Device& device, std::span<const std::byte> bytes)
      : upload(device, BufferPurpose::upload, bytes.size()),
        texels(device, BufferPurpose::texels, bytes.size()) {
    std::memcpy(upload.mapped().data(), bytes.data(), bytes.size());
  }
  Buffer upload, texels;
};

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
        systems(device, bytesOf(tables.systems)),
        links(device, bytesOf(tables.links)),
        incidences(device, bytesOf(tables.incidences)),
        lists(device, bytesOf(tables.lists)),
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
                    {&links.texels, state.positions[from], state.velocities[1 - from], &state.cloths, &rows,
                     &multipliers, &residuals, &directions});
  }
  Bindings bindSolve(const vulkan::Device& device, const vulkan::Kernel& kernel,
                     const StateBuffers& state) const {
    return Bindings(
        device, kernel,
        {&state.cloths, &systems.texels, &incidences.texels, &lists.texels, &rows, &links.texels,
         state.positions[0], &multipliers, &residuals, &directions, &products, &moves, &actives, &solves});
  }
  Bindings bindApply(const vulkan::Device& device, const vulkan::Kernel& kernel, const StateBuffers& state,
                     std::size_t to) const {
    return Bindings(device, kernel,
                    {&state.cloths, &systems.texels, &incidences.texels, &lists.texels, &rows, &multipliers,
                     &state.colliders, &state.nearColliders, state.positions[1 - to], state.positions[to],
                     state.velocities[to]});
  }

  std::uint32_t linkCount, nodeCount, systemCount, alwaysCount;
  SolveCut cut;
  std::vector<std::uint32_t> cloths;
  Table systems, links, incidences, lists;
  Buffer rows, multipliers, residuals, directions, products, moves, actives, solves, solvesReadback;
  std::array<Bindings, 2> prepareFrom;
  Bindings solveAll, solveActive;
  std::array<Bindings, 2> applyTo;
};

ConstraintStage::ConstraintStage(const vulkan::Device& device, const ConstraintTables& tables,
                                 const StateBuffers& state, std::uint32_t workgroupSize)
    : device_(device), state_(state), workgroupSize_(workgroupSize) {
  setTables(tables);
}

ConstraintStage::~ConstraintStage() = default;

void ConstraintStage::setTables(const ConstraintTables& tables) {
  if (tables.links.empty()) return systems_.reset();
  const SolveCut cut = cutSolve(device_, tables, workgroupSize_);
  std::unique_ptr<Kernels> fresh;
  if (!kernels_ || kernels_->solveAll.workgroupSize() != cut.workgroupSize)
    fresh = std::make_unique<Kernels>(device_, cut.workgroupSize);
  systems_ = std::make_unique<Systems>(device_, tables, state_, fresh ? *fresh : *kernels_, cut);
  if (fresh) kernels_ = std::move(fresh);
}

void ConstraintStage::recordTables(vulkan::Recorder& recorder) const {
  for (const Table* table : {&systems_->systems, &systems_->links, &systems_->incidences, &systems_->lists})
    recorder.copy(table->upload, table->texels, table->upload.bytes());
}

void ConstraintStage::record(vulkan::Recorder& recorder, std::uint32_t from, std::uint32_t iterations,
                             shared::ConstraintPush push) const {
  const Systems& on = *systems_;
  push.count = on.linkCount;
  recorder.barrier();
  recorder.dispatch(on.prepareFrom[from], push, on.linkCount);
  recordSolve(recorder, on.solveAll, 0, on.alwaysCount, iterations);
  recordSolve(recorder, on.solveActive, on.alwaysCount, on.systemCount - on.alwaysCount, iterations);
  push.count = on.nodeCount;
  recorder.barrier();
  recorder.dispatch(on.applyTo[1 - from], push, on.nodeCount);
}

void ConstraintStage::recordSolve(vulkan::Recorder& recorder, const Bindings& bindings,
                                  std::uint32_t firstSystem, std::uint32_t systems,
                                  std::uint32_t iterations) const {
  if (systems == 0) return;
  const SolveCut& cut = systems_->cut;
  for (std::uint32_t first = 0; first < iterations;) {
    const std::uint32_t end = first + std::min(cut.iterationsPerDispatch, iterations - first);
    recorder.barrier();
    recorder.dispatch(bindings, shared::SolvePush{first, end, firstSystem},
                      std::uint64_t{systems} * cut.workgroupSize);
    first = end;
  }
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
