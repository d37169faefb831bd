// SPDX-License-Identifier: MIT
// Tables of the linear systems of a scene.
#include "server/simulation/solve_tables.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "server/model/springs.h"
#include "server/simulation/scene_tables.h"

namespace clothstream::simulation {
namespace {

// Appends the springs that meet at a node of the cloth, two per record.
void appendList(std::span<const std::uint32_t> springs, std::span<const model::SpringLink> links,
                std::uint32_t node, std::uint32_t firstNode, std::vector<shared::SpringEndsRecord>& lists) {
  const auto self = static_cast<float>(firstNode + node);
  for (std::size_t i = 0; i < springs.size(); ++i) {
    const model::SpringLink& link = links[springs[i]];
    const bool isFirstEnd = link.a == node;
    const float number = static_cast<float>(springs[i] + 1) * (isFirstEnd ? 1.0f : -1.0f);
    const auto other = static_cast<float>(firstNode + (isFirstEnd ? link.b : link.a));
    if (i % 2 == 0)
      lists.push_back({{{number, other}, {0, self}}});
    else
      lists.back().ends[1] = {number, other};
  }
}

void appendMesh(const model::Cloth& cloth, std::size_t number, std::uint32_t firstNode, SolveTables& tables) {
  const std::vector<model::SpringLink> links = model::systemLinks(cloth);
  for (const model::SpringLink& link : links)
    tables.springs.push_back(
        {static_cast<float>(firstNode + link.a), static_cast<float>(firstNode + link.b), link.restLength,
         static_cast<float>(CLOTHSTREAM_SPRING_KINDS * number + static_cast<std::size_t>(link.kind))});
  const model::SpringAdjacency adjacency = model::springAdjacency(links, cloth.nodeCount());
  for (std::uint32_t node = 0; node < cloth.nodeCount(); ++node) {
    const std::size_t first = tables.lists.size();
    appendList(adjacency.of(node), links, node, firstNode, tables.lists);
    tables.incidences[firstNode + node] = shared::listRecord(first, tables.lists.size());
  }
}

std::uint32_t chunksOf(const model::Cloth& cloth) {
  constexpr std::uint32_t kWalk = CLOTHSTREAM_SOLVE_WALK, kLanes = CLOTHSTREAM_SOLVE_LANES;
  const auto walks = [](std::uint32_t nodes) { return (nodes + kWalk - 1) / kWalk; };
  const std::uint32_t all =
      cloth.mesh ? walks(cloth.nodeCount()) : walks(cloth.grid.rows) * cloth.grid.columns;
  return (all + kLanes - 1) / kLanes;
}

void appendSystem(const model::Cloth& cloth, std::size_t number, std::uint32_t firstNode,
                  SolveTables& tables) {
  const std::size_t firstSpring = tables.springs.size();
  if (cloth.mesh) appendMesh(cloth, number, firstNode, tables);
  const std::uint32_t chunks = chunksOf(cloth);
  const auto system = static_cast<float>(tables.systems.size());
  tables.systems.push_back({.firstSpringLow = shared::lowHalf(firstSpring),
                            .firstSpringHigh = shared::highHalf(firstSpring),
                            .springCount = static_cast<float>(tables.springs.size() - firstSpring),
                            .cloth = static_cast<float>(number),
                            .firstNode = static_cast<float>(firstNode),
                            .nodeCount = static_cast<float>(cloth.nodeCount()),
                            .rows = static_cast<float>(cloth.grid.rows),
                            .columns = static_cast<float>(cloth.grid.columns),
                            .firstChunk = static_cast<float>(tables.chunks.size()),
                            .chunkCount = static_cast<float>(chunks),
                            .reserved0 = 0,
                            .reserved1 = 0});
  for (std::uint32_t chunk = 0; chunk < chunks; ++chunk)
    tables.chunks.push_back({system, static_cast<float>(chunk), 0, 0});
}

bool isOf(const model::Cloth& cloth, const SolveGroup& group) {
  return cloth.solver.kind == group.kind && cloth.solver.acadMode == group.acadMode &&
         !model::isAssembled(cloth.solver) && (cloth.mesh != nullptr) == group.mesh;
}

// Upper bound of the loop rounds of an invocation: in a chunk, and in one iteration of a solve by one
// workgroup. Zero if nothing limits them.
struct Loops {
  std::uint64_t chunk = 0, iteration = 0;
};

Loops loopsOf(const model::Cloth& cloth, const WholeLimits& whole) {
  constexpr std::uint64_t kLanes = CLOTHSTREAM_SOLVE_LANES;
  const std::uint64_t rows = whole.spread ? 1 : CLOTHSTREAM_SOLVE_WALK;
  const std::uint64_t walks = kLanes * CLOTHSTREAM_SOLVE_WALK / rows / whole.workgroup;
  const std::uint64_t tree = 3 * kLanes / whole.workgroup + 17;
  std::uint64_t walk = 1;
  if (cloth.mesh) {
    std::vector<std::uint32_t> springs(cloth.nodeCount());  // at each node
    for (const model::SpringLink& link : model::systemLinks(cloth))
      for (const std::uint32_t node : {link.a, link.b}) ++springs[node];
    const std::uint64_t most = *std::ranges::max_element(springs);
    walk = rows * ((most + 1) / 2 + 2) + 2;
  }
  const std::uint64_t chunk = walks * (walk + 2) + tree, chunks = chunksOf(cloth);
  return {chunk, chunks * (chunk + 2) + tree + chunks};
}

// Loops of the cloths of a group. Those of other cloths are zero.
std::vector<Loops> loopsOf(std::span<const model::Cloth> cloths, const SolveGroup& group,
                           const WholeLimits& whole) {
  std::vector<Loops> loops(cloths.size());
  if (group.stretched || whole.mostLoops == kUnlimitedLoops) return loops;
  for (std::size_t i = 0; i < cloths.size(); ++i)
    if (isOf(cloths[i], group)) loops[i] = loopsOf(cloths[i], whole);
  return loops;
}

// True if one workgroup solves the system of a cloth.
bool isSmall(const model::Cloth& cloth, const SolveGroup& group, const Loops& loops,
             const WholeLimits& whole) {
  if (group.stretched) return true;
  return cloth.nodeCount() <= whole.nodes && loops.iteration <= whole.mostLoops / (kSpareIterations + 1);
}

// Appends the small or the large cloths of a group.
void appendCloths(std::span<const model::Cloth> cloths, std::span<const Loops> loopsOfCloths,
                  SolveGroup& group, bool large, const WholeLimits& whole, SolveTables& tables) {
  std::uint32_t firstNode = 0;
  for (std::size_t i = 0; i < cloths.size(); firstNode += cloths[i++].nodeCount()) {
    const model::Cloth& cloth = cloths[i];
    const Loops& loops = loopsOfCloths[i];
    if (!isOf(cloth, group) || isSmall(cloth, group, loops, whole) == large) continue;
    if (loops.chunk > whole.mostLoops)
      throw std::runtime_error(
          fmt::format("cloth '{}': so many springs meet at a vertex that a solve takes {} rounds of loops, "
                      "and this device allows {}; connect fewer triangles to one vertex, or use another "
                      "solver",
                      cloth.name, loops.chunk, whole.mostLoops));
    appendSystem(cloth, i, firstNode, tables);
    group.bend = group.bend || group.kind == model::SolverKind::implicitEuler || cloth.solver.bendConstraints;
    group.iterations = std::max(group.iterations, model::iterationsOf(cloth.solver));
    if (large) continue;
    ++group.smallSystems;
    group.smallChunks = std::max(group.smallChunks, chunksOf(cloth));
    group.smallLoops = std::max(group.smallLoops, static_cast<std::uint32_t>(loops.iteration));
  }
}

// Rounds of loops of an invocation that solves for every spring of a cloth: solve_stretched.comp.
std::uint64_t mostLoops(const model::Cloth& cloth, std::uint32_t width) {
  constexpr std::uint64_t kWalk = CLOTHSTREAM_SOLVE_WALK, kLanes = CLOTHSTREAM_SOLVE_LANES;
  const std::uint64_t texels = cloth.solver.bendConstraints ? 6 : 4;
  const std::uint64_t chunks = chunksOf(cloth), batches = (chunks + 15) / 16;
  const std::uint64_t walks = chunks * kLanes;
  const auto share = [&](std::uint64_t count) { return (count + width - 1) / width; };
  const std::uint64_t iteration = share(walks * kWalk) * (4 + texels) + share(walks) +
                                  batches * (3 * 16 * kLanes / width + 24) + 4 * kLanes / width + 28;
  const std::uint64_t round = iteration * (model::iterationsOf(cloth.solver) + 1) + 8 * share(walks);
  return round * (model::isAcad(cloth.solver, model::AcadMode::limit) ? model::kLimitRounds : 1);
}

// Decides whether one workgroup solves each system of a group for its stretched springs only.
void chooseStretched(std::span<const model::Cloth> cloths, SolveGroup& group, const StretchedLimits& limits) {
  if (group.kind != model::SolverKind::acad || group.mesh) return;
  group.stretched = true;
  for (const model::Cloth& cloth : cloths) {
    if (!isOf(cloth, group)) continue;
    const bool fits = cloth.nodeCount() <= limits.wholeNodes &&
                      chunksOf(cloth) <= CLOTHSTREAM_STRETCHED_CHUNKS &&
                      mostLoops(cloth, limits.widestWorkgroup) <= limits.mostLoops;
    group.stretched = group.stretched && fits;
    // A software device is slower with wider workgroups.
    std::uint32_t width = limits.workgroup;
    while (width < limits.widestWorkgroup && mostLoops(cloth, width) > limits.mostLoops) width *= 2;
    if (width > limits.workgroup) group.continuedWorkgroup = std::max(group.continuedWorkgroup, width);
  }
}

}  // namespace

std::uint32_t roundsOf(const SolveGroup& group) {
  const bool limit = group.kind == model::SolverKind::acad && group.acadMode == model::AcadMode::limit;
  return limit ? model::kLimitRounds : 1;
}

SolveTables solveTables(std::span<const model::Cloth> cloths, const WholeLimits& whole,
                        const StretchedLimits& stretched) {
  SolveTables tables;
  for (const model::Cloth& cloth : cloths) tables.nodes += cloth.nodeCount();
  tables.incidences.resize(tables.nodes, {0, 0, 0, 0});
  const auto count = [](const auto& table) { return static_cast<std::uint32_t>(table.size()); };
  using enum model::SolverKind;
  constexpr std::pair<model::SolverKind, model::AcadMode> kKinds[] = {
      {constraint, {}}, {acad, model::AcadMode::limit}, {acad, model::AcadMode::paper}, {implicitEuler, {}}};
  for (const auto& [kind, mode] : kKinds)
    for (const bool mesh : {false, true}) {
      SolveGroup group{.kind = kind, .acadMode = mode, .mesh = mesh};
      group.firstSystem = count(tables.systems);
      group.firstChunk = count(tables.chunks);
      group.firstSpring = count(tables.springs);
      chooseStretched(cloths, group, stretched);
      const std::vector<Loops> loops = loopsOf(cloths, group, whole);
      appendCloths(cloths, loops, group, false, whole, tables);
      group.firstLargeChunk = count(tables.chunks);
      appendCloths(cloths, loops, group, true, whole, tables);
      group.endChunk = count(tables.chunks);
      group.endSpring = count(tables.springs);
      group.endSystem = count(tables.systems);
      if (group.firstSystem < tables.systems.size()) tables.groups.push_back(group);
    }
  return tables;
}

}  // namespace clothstream::simulation
