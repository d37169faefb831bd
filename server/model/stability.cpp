// SPDX-License-Identifier: MIT
// Stability bound of explicit integration, derived with Gershgorin's circle theorem.
//
// Small motions around any shape obey M x'' = -K x - C x'. Take a spring with direction e and length |d|. It
// adds the graph Laplacian of its two nodes times  k (e e^T + (1 - L/|d|)(I - e e^T)) <= k I  to K, and the
// same Laplacian times kd e e^T <= kd I  to C. Under compression the second part of K is negative. That is
// buckling, a property of the cloth and not of the integrator. Damping adds `damping` M to C, and the air
// adds the rate of airDamping().
//
// Let s = h^2 x*Kx / x*Mx and c = h x*Cx / x*Mx be the Rayleigh quotients of a mode in a step h. Its growth z
// satisfies
//   semi-implicit Euler:  z^2 + (s + c - 2) z + 1 - c = 0,      |z| <= 1  if  s + 2c < 4  (Jury's criterion),
//   Runge-Kutta of 4th order: |z| <= 1 if h |w| <= kRungeKuttaRadius for the mode's rate w, Re w <= 0, with
//   h^2 |w|^2 = s or h |w| <= c  (underdamped or not),
//   explicit Euler:       z^2 + (c - 2) z + 1 - c + s = 0,      |z| <= 1  if  s <= c  and  2c - s < 4.
//
// Take a Laplacian with weights w_ij. The row of a node of mass m has the diagonal sum_j w_ij and
// off-diagonal entries of the same sum. So no Rayleigh quotient exceeds  max_i 2 sum_j w_ij / m.  Dihedral
// bending, which needs semi-implicit Euler, adds h^2 times bendingRate() to s. Pinned nodes have no row, but
// their springs stay on the diagonals of other nodes. With w = h^2 k + 2 h kd this bounds s + 2c. For
// explicit Euler, dashpots ensure s <= c for each spring as far as they reach. Mass-proportional damping must
// provide the rest.
#include "server/model/stability.h"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <tuple>
#include <vector>

#include "server/model/hinges.h"
#include "server/model/mesh.h"

namespace clothstream::model {
namespace {

using NodeSprings = StabilityBound::NodeSprings;

bool sameCounts(const NodeSprings& one, const NodeSprings& two) {
  return one.structural == two.structural && one.shear == two.shear && one.bend == two.bend;
}

// Number of neighbours at a distance of `step` before and after an index.
std::uint32_t neighbours(std::uint32_t index, std::uint32_t count, std::uint32_t step) {
  return (index >= step ? 1u : 0u) + (index + step < count ? 1u : 0u);
}

// All combinations of spring counts at nodes that are not pinned. If one node has the maximum of every count,
// only its combination.
std::vector<NodeSprings> gridSprings(const Cloth& cloth) {
  const std::uint32_t rows = cloth.grid.rows, columns = cloth.grid.columns;
  const double perMass = cloth.grid.nodeCount();
  const auto at = [&](std::uint32_t row, std::uint32_t column) -> NodeSprings {
    return {neighbours(row, rows, 1) + neighbours(column, columns, 1),
            neighbours(row, rows, 1) * neighbours(column, columns, 1),
            neighbours(row, rows, 2) + neighbours(column, columns, 2), perMass};
  };
  const auto atMost = [](std::uint32_t count, std::uint32_t step) {
    return std::min(2u, (count - 1) / step);
  };
  const NodeSprings most{atMost(rows, 1) + atMost(columns, 1), atMost(rows, 1) * atMost(columns, 1),
                         atMost(rows, 2) + atMost(columns, 2), perMass};
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  std::vector<NodeSprings> found;
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      if (pinned[row * columns + column] != 0) continue;
      const NodeSprings node = at(row, column);
      if (std::ranges::any_of(found, [&](const NodeSprings& f) { return sameCounts(f, node); })) continue;
      if (sameCounts(node, most)) return {most};
      found.push_back(node);
    }
  return found;
}

// All combinations of spring counts at nodes that are not pinned, each with the mass of its lightest node.
std::vector<NodeSprings> meshSprings(const Cloth& cloth) {
  std::vector<NodeSprings> nodes;
  nodes.reserve(cloth.nodeCount());
  for (const double share : cloth.mesh->shares) nodes.push_back({0, 0, 0, 1 / share});
  for (const SpringLink& link : cloth.mesh->links)
    for (const std::uint32_t node : {link.a, link.b})
      ++(link.kind == SpringKind::structural ? nodes[node].structural
         : link.kind == SpringKind::shear    ? nodes[node].shear
                                             : nodes[node].bend);
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  std::vector<NodeSprings> found;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (pinned[i] == 0) found.push_back(nodes[i]);
  // The lightest node of each combination comes first.
  std::ranges::sort(found, {}, [](const NodeSprings& node) {
    return std::tuple(node.structural, node.shear, node.bend, -node.perMass);
  });
  const auto others = std::ranges::unique(found, sameCounts);
  found.erase(others.begin(), others.end());
  return found;
}

// Maximum area of a node divided by its share of the mass, m^2. A grid node has at most six triangles, each
// of half a cell, and a third of each belongs to the node.
double areaPerShare(const Cloth& cloth) {
  if (!cloth.mesh) {
    const GridSpacing lengths = spacing(cloth.grid);
    return double{lengths.column} * lengths.row * cloth.grid.nodeCount();
  }
  double most = 0;
  for (std::size_t i = 0; i < cloth.mesh->areas.size(); ++i)
    most = std::max(most, cloth.mesh->areas[i] / cloth.mesh->shares[i]);
  return most;
}

// Maximum rate in 1/s at which air can slow a node. The force on a triangle is 0.5 rho (C_D |N.u| u + C_L
// ...), a function of the mean velocity of its three nodes. The symmetric part of its derivative is at most
// 0.5 rho (2 C_D + C_L) |N| |u|. Each node gets a third of it, so a row sums to 0.5 rho (2 C_D + C_L) |u|
// area / m.
// A local wind that changes from place to place adds no growth: the air draws the velocity of a node towards
// its own, which is bounded.
double airDamping(const Cloth& cloth, double areaPerShare, const Scene& scene, double added) {
  const Environment& environment = scene.environment;
  const double gust = std::sqrt(3.0) * environment.gust.strength;
  const double local = double{speedOf(scene.winds)} + added;
  const double speed = environment.wind.cast<double>().norm() + gust + local + kAirSpeed;
  return 0.5 * environment.airDensity * (2.0 * cloth.drag + cloth.lift) * speed * areaPerShare / cloth.mass;
}

// Whether semi-implicit Euler with step h is stable: s + 2c < 4.
bool semiImplicitStable(const Cloth& cloth, const NodeSprings& node, double air, double bending, double h) {
  const auto weight = [&](const Spring& spring) { return h * h * spring.stiffness + 2 * h * spring.damping; };
  const double springs = node.structural * weight(cloth.structural) + node.shear * weight(cloth.shear) +
                         node.bend * weight(cloth.bend);
  return 2 * springs * node.perMass + h * h * bending + 2 * h * (cloth.damping + air) < 4;
}

// Whether the Runge-Kutta method with step h is stable: s <= r^2 and c <= r.
bool rungeKuttaStable(const Cloth& cloth, const NodeSprings& node, double air, double, double h) {
  // Radius of the largest half disc around 0 inside |1 + z + z^2/2 + z^3/6 + z^4/24| <= 1, rounded down.
  constexpr double kRungeKuttaRadius = 2.61;
  const auto sum = [&](auto&& of) {
    return node.structural * of(cloth.structural) + node.shear * of(cloth.shear) + node.bend * of(cloth.bend);
  };
  const double stiffness = sum([](const Spring& spring) { return double{spring.stiffness}; });
  const double damping = sum([](const Spring& spring) { return double{spring.damping}; });
  return h * h * 2 * stiffness * node.perMass <= kRungeKuttaRadius * kRungeKuttaRadius &&
         h * (2 * damping * node.perMass + cloth.damping + air) <= kRungeKuttaRadius;
}

// Whether explicit Euler with step h is stable: s <= c, and c < 2, from which 2c - s < 4 follows.
bool explicitStable(const Cloth& cloth, const NodeSprings& node, double air, double, double h) {
  const double tension = 1 - 1 / (1 + double{kTensionStrain});
  // Damping that a spring needs in addition to its dashpot: along the spring the rest, across it all of the
  // tension.
  const auto deficit = [&](const Spring& spring) {
    return std::max(h * spring.stiffness - spring.damping, h * spring.stiffness * tension);
  };
  const double deficits = node.structural * deficit(cloth.structural) + node.shear * deficit(cloth.shear) +
                          node.bend * deficit(cloth.bend);
  const double dashpots = node.structural * double{cloth.structural.damping} +
                          node.shear * double{cloth.shear.damping} + node.bend * double{cloth.bend.damping};
  return 2 * deficits * node.perMass <= cloth.damping &&
         h * (2 * dashpots * node.perMass + cloth.damping + air) < 2;
}

// The cloth as far as its solver integrates it explicitly. Constraints and the springs of implicit Euler are
// solved implicitly and set no bound. Springs of xpbd are also damped implicitly.
Cloth explicitPart(Cloth cloth) {
  if (isConstraint(cloth.solver, SpringKind::structural))
    cloth.structural.stiffness = cloth.shear.stiffness = 0;
  if (isConstraint(cloth.solver, SpringKind::bend)) cloth.bend.stiffness = 0;
  if (cloth.solver.kind == SolverKind::implicitEuler || cloth.solver.kind == SolverKind::xpbd)
    cloth.structural = cloth.shear = cloth.bend = {};
  return cloth;
}

}  // namespace

StabilityBound::StabilityBound(const Scene& scene) {
  for (const Cloth& cloth : scene.cloths) {
    Cloth ofOneKilogram = cloth;
    ofOneKilogram.mass = 1;
    const bool mayBend =
        scene.integrator == Integrator::semiImplicitEuler && cloth.nodeCount() <= kMaxBendingNodes;
    cloths_.push_back({.nodes = cloth.mesh ? meshSprings(cloth) : gridSprings(cloth),
                       .areaPerShare = areaPerShare(cloth),
                       .bendingRate = mayBend ? bendingRate(ofOneKilogram) : 0});
  }
}

StabilityBound::Criterion StabilityBound::criterionOf(const Scene& scene, std::size_t index) const {
  const auto stable = scene.integrator == Integrator::semiImplicitEuler ? semiImplicitStable
                      : scene.integrator == Integrator::rungeKutta4     ? rungeKuttaStable
                                                                        : explicitStable;
  const ClothBound& bound = cloths_[index];
  const double bending = scene.cloths[index].dihedralBending * bound.bendingRate / scene.cloths[index].mass;
  return
      [&scene, &bound, stable, bending, cloth = explicitPart(scene.cloths[index])](double h, double added) {
        const double air = airDamping(cloth, bound.areaPerShare, scene, added);
        return std::ranges::all_of(bound.nodes, [&](NodeSprings node) {
          node.perMass /= cloth.mass;
          return stable(cloth, node, air, bending, h);
        });
      };
}

std::uint32_t StabilityBound::substeps(const Scene& scene) const {
  // Smaller steps only make the criteria easier to meet.
  std::uint32_t substeps = 1;
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    const Criterion stable = criterionOf(scene, i);
    substeps = *std::ranges::partition_point(
        std::views::iota(substeps, kMaxSubsteps + 1),
        [&](std::uint32_t count) { return !stable(scene.tickSeconds() / count, 0); });
    if (substeps > kMaxSubsteps) return 0;
  }
  return substeps;
}

float StabilityBound::roomForWind(const Scene& scene, std::uint32_t substeps) const {
  constexpr int kBisections = 20;
  const double h = scene.tickSeconds() / substeps;
  double room = kMaxHeldSpeed;
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    const Criterion stable = criterionOf(scene, i);
    if (stable(h, room)) continue;
    double fits = 0;
    for (int k = 0; k < kBisections; ++k) {
      const double middle = (fits + room) / 2;
      (stable(h, middle) ? fits : room) = middle;
    }
    room = fits;
  }
  return static_cast<float>(room);
}

double bearableStiffness(const Cloth& cloth, double h) {
  double share = 1;
  for (const NodeSprings& node : cloth.mesh ? meshSprings(cloth) : gridSprings(cloth)) {
    const auto sum = [&](auto&& of) {
      return node.structural * of(cloth.structural) + node.shear * of(cloth.shear) +
             node.bend * of(cloth.bend);
    };
    const double perMass = 2 * node.perMass / cloth.mass;
    const double elastic = h * h * perMass * sum([](const Spring& s) { return double{s.stiffness}; });
    const double viscous =
        2 * h * (perMass * sum([](const Spring& s) { return double{s.damping}; }) + cloth.damping);
    // s + 2c < 4, as in semiImplicitStable().
    if (elastic > 0) share = std::min(share, std::max(0.0, 0.9 * (4 - viscous) / elastic));
  }
  return share;
}

double stiffnessShare(const Cloth& cloth, double h) {
  return isAcad(cloth.solver, AcadMode::limit) ? bearableStiffness(cloth, h) : 1;
}

std::uint32_t stableSubsteps(const Scene& scene) {
  return StabilityBound(scene).substeps(scene);
}

}  // namespace clothstream::model
