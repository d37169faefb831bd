// SPDX-License-Identifier: MIT
// The springs of a cloth as a list, and which of them meet at a node.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"

namespace clothstream::model {

enum class SpringKind : std::uint8_t { structural, shear, bend };
inline constexpr std::size_t kSpringKinds = 3;

// Between two nodes of one cloth, a < b.
struct SpringLink {
  std::uint32_t a = 0, b = 0;
  SpringKind kind = SpringKind::structural;
  float restLength = 0;  // m
};

// Every spring once, by ascending a; of one a by kind, then by ascending b. A grid's: [Va21] Fig. 1; a
// mesh's: makeMesh().
std::vector<SpringLink> springLinks(const Cloth& cloth);

// Length at rest of the shortest structural spring, m.
float shortestSpring(const Cloth& cloth);

const Spring& springOf(const Cloth& cloth, SpringKind kind);

// Whether the cloth's solver keeps springs of this kind at their length, always or when they are stretched
// too far.
bool isConstraint(const Solver& solver, SpringKind kind);

// Those that the cloth's linear system is of (its constraints; of implicit Euler all), in the order of
// springLinks(), but for springs between two nodes that no force moves: they have no part in it.
std::vector<SpringLink> systemLinks(const Cloth& cloth);

// Entries of the matrix that an assembled path multiplies out of these: where two of them, or one with
// itself, share a node that can move. A mesh's grow with the square of what meets at a node.
std::uint64_t systemEntries(const Cloth& cloth);

// As a force: without stiffness where it always is a constraint. Constraints keep their damping, but those of
// xpbd, which are damped as constraints.
Spring forceOf(const Cloth& cloth, SpringKind kind);

// Of the cloth's constraints, 1/kg: what stands on the diagonal of their system in a substep of h seconds.
double scaledCompliance(const Cloth& cloth, double h);

// What xpbd does with a spring in a substep of h seconds. Its excess of length C, how much that grew in this
// substep, D, and its multiplier lambda so far give
//   -(stretch C + damping D + memory lambda) / ((stretch + damping) (w_a + w_b) + memory)
// more of lambda, [MMC16] Eq. 18 and 26 times whatever keeps all three numbers small. All but memory 0: the
// spring is not there.
struct XpbdSpring {
  double stretch = 0, damping = 0, memory = 1;
};
XpbdSpring xpbdSpring(const Cloth& cloth, SpringKind kind, double h);

// Which springs meet at each node, in the order of the list.
struct SpringAdjacency {
  std::vector<std::uint32_t> first;    // a node's first place in `springs`; one more at the end
  std::vector<std::uint32_t> springs;  // indices into the list, each twice

  std::span<const std::uint32_t> of(std::uint32_t node) const {
    return std::span(springs).subspan(first[node], first[node + 1] - first[node]);
  }
};
SpringAdjacency springAdjacency(std::span<const SpringLink> links, std::uint32_t nodeCount);

}  // namespace clothstream::model
