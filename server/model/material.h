// SPDX-License-Identifier: MIT
// What cloths may be made of, by name.
#pragma once

#include <span>
#include <string_view>

#include "server/model/scene.h"

namespace clothstream::model {

// What a cloth is where nobody says anything else. The stiffness of a structural or shear spring is the
// cloth's own in tension along its threads and in shear, in N/m, whatever the nodes' distance; that of bend
// springs follows from the rigidity, see bendStiffness(). Springs have no dashpots: `damping`, the air and
// the solver damp.
struct Material {
  std::string_view name;
  std::string_view description;  // one line
  std::string_view source;       // of the numbers, one line
  float arealMass;               // kg/m^2
  float tension, shear;          // N/m
  float rigidity;                // N m, against bending
  float damping;                 // 1/s
  float drag, lift;              // dimensionless
  float friction;                // Coulomb
};

// By name in alphabetical order.
std::span<const Material> materials();

// nullptr: there is none of that name.
const Material* findMaterial(std::string_view name);

// m: the bending length of cloth, (rigidity / weight)^(1/3): half of what a strip hangs over an edge when it
// bends down by 41.5 degrees (Peirce, "The handle of cloth as a measurable quantity", 1930; ASTM D1388).
double bendingLength(const Material& material);

// N/m, of a cloth's bend springs. A spring from a node to the next but one, both `a` apart, shortens with the
// square of the angle between: its energy is that of a bent cloth at one curvature only. Chosen is that of a
// strip of twice the bending length over an edge, so that the spring is 16 rigidity / (a^4 curvature^2). `a`
// is half of a bend spring's mean length; no bend spring is stiffer than the cloth in tension.
double bendStiffness(const Material& material, const Cloth& cloth);

// The cloth, which has its shape, becomes one of this material, its solver (xpbd) included.
void makeOf(const Material& material, Cloth& cloth);

}  // namespace clothstream::model
