// SPDX-License-Identifier: MIT
// Springs of a cloth as a list, and the springs at each node.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

enum class SpringKind : std::uint8_t { structural, shear, bend };
inline constexpr std::size_t kSpringKinds = 3;

// Spring between two nodes of one cloth, a < b.
struct SpringLink {
  std::uint32_t a = 0, b = 0;
  SpringKind kind = SpringKind::structural;
  float restLength = 0;  // m
};

// All springs, ordered by a, then kind, then b. [Va21] Fig. 1 gives the springs of a grid, makeMesh() those
// of a mesh.
std::vector<SpringLink> springLinks(const Cloth& cloth);

// Number of springLinks(), in constant time.
std::uint64_t springCount(const Cloth& cloth);

// Rest length of the shortest structural spring, m.
float shortestSpring(const Cloth& cloth);

const Spring& springOf(const Cloth& cloth, SpringKind kind);

// True if the solver keeps springs of this kind at their length, always or when they are stretched too far.
bool isConstraint(const Solver& solver, SpringKind kind);

// Springs that form the linear system of the cloth, in the order of springLinks(): its constraints, or all
// springs for implicit Euler. Springs between two nodes that no force moves are left out.
std::vector<SpringLink> systemLinks(const Cloth& cloth);

// Number of entries of the assembled system matrix: one for each pair of its springs, or spring with itself,
// that shares a node that can move. It grows with the square of the springs per node.
std::uint64_t systemEntries(const Cloth& cloth);

// Force of a spring of this kind. A spring that is always a constraint has no stiffness, but keeps its
// damping. With xpbd it has no damping either, because the constraint is damped.
Spring forceOf(const Cloth& cloth, SpringKind kind);

// Compliance term on the diagonal of the constraint system in a substep of h seconds, 1/kg.
double scaledCompliance(const Cloth& cloth, double h);

// Coefficients of a spring in xpbd for a substep of h seconds. C is its excess length, D the growth of C in
// this substep, and lambda its multiplier. An iteration adds
//   -(stretch C + damping D + memory lambda) / ((stretch + damping) (w_a + w_b) + memory)
// to lambda: [MMC16] Eq. 18 and 26, scaled so that all three coefficients are small. If stretch and damping
// are 0, there is no spring.
struct XpbdSpring {
  double stretch = 0, damping = 0, memory = 1;
};
XpbdSpring xpbdSpring(const Cloth& cloth, SpringKind kind, double h);

// Springs at each node, in the order of the list.
struct SpringAdjacency {
  std::vector<std::uint32_t> first;    // first index in `springs` per node; one more at the end
  std::vector<std::uint32_t> springs;  // indices into the list, each twice

  std::span<const std::uint32_t> of(std::uint32_t node) const {
    return std::span(springs).subspan(first[node], first[node + 1] - first[node]);
  }
};
SpringAdjacency springAdjacency(std::span<const SpringLink> links, std::uint32_t nodeCount);

}  // namespace clothstream::model
