// SPDX-License-Identifier: MIT
// The stages that follow from the solvers and the bending of the cloths, which may change while a scene runs.
#include "server/simulation/solvers.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "server/simulation/assembled/assembled_stage.h"
#include "server/simulation/xpbd_stage.h"

namespace clothstream::simulation {
namespace {

std::vector<model::Solver> solversOf(std::span<const model::Cloth> cloths) {
  std::vector<model::Solver> solvers;
  for (const model::Cloth& cloth : cloths) solvers.push_back(cloth.solver);
  return solvers;
}

// The stage of a solver is made of these.
struct Ingredients {
  const vulkan::Device& device;
  std::span<const model::Cloth> cloths;
  const StateBuffers& state;
  const SolverSizes& sizes;
};

std::unique_ptr<SolverStage> makeAssembled(const Ingredients& of) {
  if (!AssembledStage::isIn(of.cloths)) return nullptr;
  return std::make_unique<AssembledStage>(of.device, of.cloths, of.state, of.sizes.askedWorkgroup,
                                          of.sizes.solveWholeNodes);
}

std::unique_ptr<SolverStage> makeXpbd(const Ingredients& of) {
  if (!XpbdStage::isIn(of.cloths)) return nullptr;
  return std::make_unique<XpbdStage>(of.device, of.cloths, of.state, of.sizes.askedWorkgroup,
                                     of.sizes.xpbdWholeNodes);
}

// Every solver besides those of SolveStage, in the order in which their stages act. Each function returns
// null if no cloth has the solver.
constexpr std::unique_ptr<SolverStage> (*kMakers[])(const Ingredients&) = {makeAssembled, makeXpbd};

}  // namespace

Solvers::Solvers(const vulkan::Device& device, const StateBuffers& state,
                 std::span<const model::Cloth> cloths, const SolverSizes& sizes)
    : device_(device),
      state_(state),
      sizes_(sizes),
      solves_(device, state, sizes.askedWorkgroup, sizes.solveWholeNodes) {
  exchange(makeSolvers(cloths));
  bending_ = makeBending(bendingCloths(cloths));
  bends_ = bending_ != nullptr;
}

// Cloths that bent once stay in the tables, so that each cloth needs new ones at most once.
std::vector<model::Cloth> Solvers::bendingCloths(std::span<const model::Cloth> cloths) const {
  if (!BendingStage::isIn(cloths) || (bending_ && bending_->serves(cloths))) return {};
  std::vector<model::Cloth> all(cloths.begin(), cloths.end());
  for (std::size_t i = 0; bending_ && i < all.size(); ++i)
    if (bending_->bends(i)) all[i].dihedralBending = 1;
  return all;
}

std::unique_ptr<BendingStage> Solvers::makeBending(std::span<const model::Cloth> cloths) const {
  if (cloths.empty()) return nullptr;
  return std::make_unique<BendingStage>(device_, cloths, state_, sizes_.workgroup);
}

SolverStages Solvers::makeSolvers(std::span<const model::Cloth> cloths) {
  const std::lock_guard lock(making_);
  const std::uint64_t before = vulkan::Buffer::bytesOfThread();
  SolverStages stages;
  stages.solvers = solversOf(cloths);
  stages.systems = solves_.makeSystems(cloths);
  for (const auto maker : kMakers)
    if (std::unique_ptr<SolverStage> stage = maker({device_, cloths, state_, sizes_}))
      stages.others.push_back(std::move(stage));
  stages.bytes = vulkan::Buffer::bytesOfThread() - before;
  return stages;
}

SolverStages Solvers::exchange(SolverStages next) {
  solves_.use(next.systems);
  return std::exchange(present_, std::move(next));
}

std::vector<SolverStage*> Solvers::afterForces() {
  std::vector<SolverStage*> stages{&solves_};
  for (const auto& stage : present_.others) stages.push_back(stage.get());
  return stages;
}

bool Solvers::needsSolvers(std::span<const model::Solver> wanted) const {
  const bool has = haveSameTables(wanted, present_.solvers) || kept_.has(wanted) ||
                   (taken_ && taken_->solvers && haveSameTables(wanted, taken_->solvers->solvers));
  return !has;
}

bool Solvers::needsBending(std::span<const model::Cloth> cloths) const {
  const bool isTaken = taken_ && taken_->bending && taken_->bending->serves(cloths);
  return !isTaken && !bendingCloths(cloths).empty();
}

bool Solvers::needs(std::span<const model::Cloth> cloths) const {
  return needsSolvers(solversOf(cloths)) || needsBending(cloths);
}

StagePlan Solvers::plan(std::span<const model::Cloth> cloths) const {
  StagePlan plan{.solvers = {}, .bending = bendingCloths(cloths)};
  if (needsSolvers(solversOf(cloths))) plan.solvers.assign(cloths.begin(), cloths.end());
  return plan;
}

std::shared_ptr<NewStages> Solvers::make(const StagePlan& plan) {
  auto stages = std::make_shared<NewStages>();
  if (!plan.solvers.empty()) stages->solvers = makeSolvers(plan.solvers);
  stages->bending = makeBending(plan.bending);
  return stages;
}

bool Solvers::set(std::span<const model::Cloth> cloths) {
  // Memory is allocated before anything changes, because that may fail.
  const std::vector<model::Solver> wanted = solversOf(cloths);
  const std::vector<model::Cloth> bent = bendingCloths(cloths);
  const bool takes = !bent.empty() && !needsBending(cloths);
  std::unique_ptr<BendingStage> bending = takes ? nullptr : makeBending(bent);
  const bool changes = !haveSameTables(wanted, present_.solvers);
  if (changes) {
    std::optional<SolverStages> next = kept_.take(wanted);
    if (!next && !needsSolvers(wanted)) next = std::exchange(taken_->solvers, std::nullopt);
    if (!next) {
      next = makeSolvers(cloths);
      ++made_;
    }
    kept_.keep(exchange(std::move(*next)));
  }
  if (takes) bending = std::move(taken_->bending);
  if (bending) {
    bending_ = std::move(bending);
    ++made_;
  }
  bends_ = BendingStage::isIn(cloths);
  taken_.reset();
  return changes;
}

void Solvers::prepare(std::span<const shared::ClothRecord> cloths) {
  for (SolverStage* stage : afterForces()) stage->prepare(cloths);
}

void Solvers::addTo(std::span<ClothReport> reports) const {
  const auto add = [&](const SolverStage& stage) {
    const std::span<const shared::SolveRecord> solves = stage.report();
    for (std::size_t i = 0; i < solves.size(); ++i) {
      ClothReport& report = reports[stage.cloths()[i]];
      report.activeConstraints = solves[i].constraints;
      report.iterations = solves[i].iterations;
      report.residual = solves[i].residual;
    }
  };
  add(solves_);
  for (const auto& stage : present_.others) add(*stage);
}

std::vector<shared::SolveRecord> Solvers::records() const {
  std::vector<shared::SolveRecord> records;
  std::ranges::copy(solves_.report(), std::back_inserter(records));
  for (const auto& stage : present_.others) std::ranges::copy(stage->report(), std::back_inserter(records));
  return records;
}

bool Solvers::recordActiveSprings(vulkan::Recorder& recorder) {
  if (!solves_.active()) return false;
  const std::uint64_t before = vulkan::Buffer::bytesOfThread();
  solves_.recordActiveSprings(recorder);
  present_.bytes += vulkan::Buffer::bytesOfThread() - before;
  return true;
}

}  // namespace clothstream::simulation
