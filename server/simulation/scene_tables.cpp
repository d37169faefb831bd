// SPDX-License-Identifier: MIT
// A scene as the kernels read it: a record a cloth, a record a workgroup.
#include "server/simulation/scene_tables.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>

#include "server/model/springs.h"

namespace clothstream::simulation {
namespace {

// As kernels store numbers, so that a state at rest has been through them already.
float snapTiny(float x) {
  return std::abs(x) < 1e-20f ? 0.0f : x;
}

// Where springs become constraints, how much of what is too much is taken back; the third tells from those
// that always are.
shared::vec4 limitsOf(const model::Cloth& cloth) {
  const model::Solver& solver = cloth.solver;
  const bool adaptive = solver.kind == model::SolverKind::acad;
  return {adaptive ? solver.activation : 0, model::correctionFraction(solver), adaptive ? 1.0f : 0.0f,
          cloth.dihedralBending};
}

// Compliance over h^2, iterations and tolerance of conjugate gradients; whether it has bend springs.
shared::vec4 solverOf(const model::Cloth& cloth, double substepSeconds) {
  if (followOf(cloth.solver.kind) != Follow::solve) return {0, 0, 0, 0};
  const bool bend = cloth.solver.kind == model::SolverKind::implicitEuler || cloth.solver.bendConstraints;
  return {static_cast<float>(model::scaledCompliance(cloth, substepSeconds)),
          static_cast<float>(cloth.solver.iterations), cloth.solver.tolerance * cloth.solver.tolerance,
          bend ? 1.0f : 0.0f};
}

shared::vec4 xpbdSpringOf(const model::Cloth& cloth, model::SpringKind kind, double substepSeconds, float w) {
  if (cloth.solver.kind != model::SolverKind::xpbd) return {0, 0, 0, 0};
  const model::XpbdSpring spring = model::xpbdSpring(cloth, kind, substepSeconds);
  return {static_cast<float>(spring.stretch), static_cast<float>(spring.damping),
          static_cast<float>(spring.memory), w};
}

}  // namespace

Follow followOf(model::SolverKind kind) {
  if (kind == model::SolverKind::massSpring) return Follow::nothing;
  return kind == model::SolverKind::xpbd ? Follow::corrections : Follow::solve;
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
    const auto force = [&](model::SpringKind kind) { return model::forceOf(cloth, kind); };
    const auto xpbd = [&](model::SpringKind kind, float w) {
      return xpbdSpringOf(cloth, kind, substepSeconds, w);
    };
    const auto inverseMass = static_cast<float>(cloth.nodeCount() / double{cloth.mass});
    using enum model::SpringKind;
    records.push_back(
        {.place = {whole(firstNode & 0xFFFF), whole(firstNode >> 16), cloth.mesh ? 0 : whole(cloth.grid.rows),
                   whole(cloth.mesh ? cloth.nodeCount() : cloth.grid.columns)},
         .spacing = {spacing.column, spacing.row, spacing.diagonal, cloth.damping},
         .stiffness = {force(structural).stiffness, force(shear).stiffness, force(bend).stiffness,
                       cloth.friction},
         .damping = {force(structural).damping, force(shear).damping, force(bend).damping, cloth.thickness},
         .air = {cloth.drag, cloth.lift, cloth.selfCollision ? cloth.selfCollision->radius : 0.0f,
                 cloth.selfCollision ? cloth.selfCollision->friction : 0.0f},
         .solver = solverOf(cloth, substepSeconds),
         .limits = limitsOf(cloth),
         .springs = {xpbd(structural, static_cast<float>(cloth.solver.iterations)), xpbd(shear, inverseMass),
                     xpbd(bend, 0)}});
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
      if (cloths[cloth].mesh || followOf(cloths[cloth].solver.kind) != follow) continue;
      const model::Grid& grid = cloths[cloth].grid;
      const std::uint32_t strips = (grid.rows + rowsPerInvocation - 1) / rowsPerInvocation;
      const std::uint64_t invocations = std::uint64_t{strips} * grid.columns;
      for (std::uint64_t first = 0; first < invocations; first += workgroupSize)
        tiles.records.push_back(
            {{static_cast<float>(cloth),
              static_cast<float>(static_cast<std::uint32_t>(first / grid.columns) * rowsPerInvocation),
              static_cast<float>(first % grid.columns), 0}});
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

NodeState restState(std::span<const model::Cloth> cloths) {
  NodeState state;
  for (const model::Cloth& cloth : cloths) {
    const std::vector<model::Vec3> positions = model::restPositions(cloth);
    std::transform(positions.begin(), positions.end(), std::back_inserter(state.positions),
                   [](const model::Vec3& p) { return model::Vec3(p.unaryExpr(&snapTiny)); });
  }
  state.velocities.assign(state.positions.size(), model::Vec3::Zero());
  return state;
}

}  // namespace clothstream::simulation
