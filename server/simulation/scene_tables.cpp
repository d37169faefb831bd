// SPDX-License-Identifier: MIT
// Tables of a scene: one record per cloth and one per workgroup.
#include "server/simulation/scene_tables.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "server/model/cloth_skin.h"
#include "server/model/gas.h"
#include "server/model/origin.h"
#include "server/model/springs.h"
#include "server/model/stability.h"
#include "server/model/strain_limit.h"

namespace clothstream::simulation {
namespace {

// Kernels store numbers in this form. A state at rest must have it from the start.
float snapTiny(float x) {
  return std::abs(x) < 1e-20f ? 0.0f : x;
}

shared::XpbdSpringRecord xpbdSpringOf(const model::Cloth& cloth, model::SpringKind kind,
                                      double substepSeconds) {
  if (cloth.solver.kind != model::SolverKind::xpbd) return {0, 0, 0, 0};
  const model::XpbdSpring spring = model::xpbdSpring(cloth, kind, substepSeconds);
  return {static_cast<float>(spring.stretch), static_cast<float>(spring.damping),
          static_cast<float>(spring.memory), 0};
}

// Sets the members of the record that only solvers read.
void setSolver(const model::Cloth& cloth, double substepSeconds, shared::ClothRecord& record) {
  const model::Solver& solver = cloth.solver;
  using enum model::SpringKind;
  record.activation = solver.kind == model::SolverKind::acad ? model::heldStrain(solver) : 0;
  record.correctionFraction = model::correctionFraction(solver);
  for (const model::SpringKind kind : {structural, shear, bend})
    record.xpbdSprings[static_cast<std::size_t>(kind)] = xpbdSpringOf(cloth, kind, substepSeconds);
  if (solver.kind == model::SolverKind::massSpring) return;
  record.solverIterations = static_cast<float>(model::iterationsOf(solver));
  if (followOf(solver) == Follow::corrections) return;
  record.scaledCompliance = static_cast<float>(model::scaledCompliance(cloth, substepSeconds));
  record.squaredTolerance = solver.tolerance * solver.tolerance;
  record.solvesBend = solver.kind == model::SolverKind::implicitEuler || solver.bendConstraints ? 1.0f : 0.0f;
}

}  // namespace

Follow followOf(const model::Solver& solver) {
  if (solver.kind == model::SolverKind::massSpring) return Follow::nothing;
  if (solver.kind == model::SolverKind::xpbd) return Follow::corrections;
  return solver.kind == model::SolverKind::acad ? followOf(solver.acadMode) : Follow::solve;
}

Follow followOf(const model::Cloth& cloth) {
  const Follow follow = followOf(cloth.solver);
  return follow == Follow::nothing && model::hasGas(cloth) ? Follow::gas : follow;
}

Follow followOf(model::AcadMode mode) {
  return mode == model::AcadMode::paper ? Follow::paper : Follow::limit;
}

std::vector<std::uint32_t> clothOffsets(std::span<const model::Cloth> cloths) {
  std::vector<std::uint32_t> offsets{0};
  for (const model::Cloth& cloth : cloths) offsets.push_back(offsets.back() + cloth.nodeCount());
  return offsets;
}

std::vector<shared::ClothRecord> clothRecords(std::span<const model::Cloth> cloths, double substepSeconds) {
  std::vector<shared::ClothRecord> records;
  std::uint32_t firstNode = 0;
  for (const model::Cloth& cloth : cloths) {
    const model::GridSpacing spacing = model::spacing(cloth.grid);
    const auto whole = [](std::uint32_t number) {
      assert(number < 1u << 24);
      return static_cast<float>(number);
    };
    using enum model::SpringKind;
    const model::Spring structuralForce = model::forceOf(cloth, structural);
    const model::Spring shearForce = model::forceOf(cloth, shear);
    const model::Spring bendForce = model::forceOf(cloth, bend);
    const auto borne = static_cast<float>(model::stiffnessShare(cloth, substepSeconds));
    shared::ClothRecord record{};
    record.firstNodeLow = shared::lowHalf(firstNode);
    record.firstNodeHigh = shared::highHalf(firstNode);
    record.rows = cloth.mesh ? 0 : whole(cloth.grid.rows);
    record.columns = whole(cloth.mesh ? cloth.nodeCount() : cloth.grid.columns);
    record.columnSpacing = spacing.column;
    record.rowSpacing = spacing.row;
    record.diagonalSpacing = spacing.diagonal;
    record.velocityDecay = cloth.damping;
    record.structuralStiffness = borne * structuralForce.stiffness;
    record.shearStiffness = borne * shearForce.stiffness;
    record.bendStiffness = borne * bendForce.stiffness;
    record.friction = cloth.friction;
    record.structuralDamping = structuralForce.damping;
    record.shearDamping = shearForce.damping;
    record.bendDamping = bendForce.damping;
    record.thickness = cloth.thickness;
    record.drag = cloth.drag;
    record.lift = cloth.lift;
    record.ballRadius = cloth.selfCollision ? cloth.selfCollision->radius : 0.0f;
    record.ballFriction = cloth.selfCollision ? cloth.selfCollision->friction : 0.0f;
    record.gridInverseMass = static_cast<float>(cloth.nodeCount() / double{cloth.mass});
    record.bendingRigidity = cloth.dihedralBending;
    setSolver(cloth, substepSeconds, record);
    records.push_back(record);
    firstNode += cloth.nodeCount();
  }
  return records;
}

Tiles makeTiles(std::span<const model::Cloth> cloths, std::uint32_t rowsPerInvocation,
                std::uint32_t workgroupSize) {
  assert(rowsPerInvocation > 0 && workgroupSize > 0);
  Tiles tiles;
  for (const Follow follow : kFollows) {
    for (std::uint32_t cloth = 0; cloth < cloths.size(); ++cloth) {
      if (cloths[cloth].mesh || followOf(cloths[cloth]) != follow) continue;
      const model::Grid& grid = cloths[cloth].grid;
      const std::uint32_t strips = (grid.rows + rowsPerInvocation - 1) / rowsPerInvocation;
      const std::uint64_t invocations = std::uint64_t{strips} * grid.columns;
      for (std::uint64_t first = 0; first < invocations; first += workgroupSize)
        tiles.records.push_back(
            {static_cast<float>(cloth),
             static_cast<float>(static_cast<std::uint32_t>(first / grid.columns) * rowsPerInvocation),
             static_cast<float>(first % grid.columns), 0});
    }
    tiles.ranges.ends[static_cast<std::size_t>(follow)] = static_cast<std::uint32_t>(tiles.records.size());
  }
  return tiles;
}

std::vector<float> inverseMasses(std::span<const model::Cloth> cloths) {
  std::vector<float> all;
  for (const model::Cloth& cloth : cloths) {
    const std::vector<double> masses = model::nodeMasses(cloth);
    const std::vector<std::uint8_t> pinned = model::pinnedNodes(cloth);
    for (std::size_t i = 0; i < masses.size(); ++i)
      all.push_back(pinned[i] != 0 ? 0.0f : static_cast<float>(1 / masses[i]));
  }
  return all;
}

namespace {

void append(std::span<const model::Vec3> positions, NodeState& state) {
  std::ranges::transform(positions, std::back_inserter(state.positions),
                         [](const model::Vec3& p) { return model::Vec3(p.unaryExpr(&snapTiny)); });
  state.velocities.resize(state.positions.size(), model::Vec3::Zero());
}

}  // namespace

NodeState restState(std::span<const model::Cloth> cloths) {
  NodeState state;
  for (const model::Cloth& cloth : cloths) append(model::restPositions(cloth, model::Vec3::Zero()), state);
  return state;
}

NodeState startState(const model::Scene& scene, const model::Vec3& origin) {
  NodeState state;
  for (const model::Cloth& cloth : scene.cloths) {
    append(model::startPositions(scene, cloth, origin), state);
    const std::vector<model::Vec3> velocities = model::startVelocities(scene, cloth);
    std::ranges::transform(velocities,
                           state.velocities.end() - static_cast<std::ptrdiff_t>(velocities.size()),
                           [](const model::Vec3& v) { return model::Vec3(v.unaryExpr(&snapTiny)); });
  }
  return state;
}

}  // namespace clothstream::simulation
