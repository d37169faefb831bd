// SPDX-License-Identifier: MIT
// Materials of cloths, by name.
#pragma once

#include <span>
#include <string_view>

#include "server/model/scene.h"

namespace clothstream::model {

// Default numbers of a cloth. The stiffness of structural and shear springs is the stiffness of the fabric in
// tension along its threads and in shear, in N/m, independent of the distance between nodes. bendStiffness()
// derives the stiffness of bend springs from the rigidity. Springs have no dashpots: `damping`, the air and
// the solver damp.
struct Material {
  std::string_view name;
  std::string_view description;  // one line
  std::string_view source;       // source of the numbers, one line
  float arealMass;               // kg/m^2
  float tension, shear;          // N/m
  float rigidity;                // flexural rigidity, N m
  float damping;                 // 1/s
  float drag, lift;              // dimensionless
  float friction;                // Coulomb
};

// All materials in alphabetical order of their names.
std::span<const Material> materials();

// nullptr if no material has that name.
const Material* findMaterial(std::string_view name);

// Bending length in metres: (rigidity / weight)^(1/3). It is half the overhang at which a strip bends down by
// 41.5 degrees (Peirce, "The handle of cloth as a measurable quantity", 1930; ASTM D1388).
double bendingLength(const Material& material);

// Stiffness of a cloth's bend springs, N/m. A bend spring skips one node at a distance of `a` from both ends.
// It shortens with the square of the angle, so its energy matches that of bent cloth at one curvature only.
// The chosen curvature is that of a strip that hangs over an edge by twice its bending length. The stiffness
// is then 16 rigidity / (a^4 curvature^2), but at most the stiffness in tension. `a` is half of the mean
// length of the bend springs.
double bendStiffness(const Material& material, const Cloth& cloth);

// Sets the numbers and the solver (xpbd) of a cloth to those of the material. The cloth must have its shape.
void makeOf(const Material& material, Cloth& cloth);

}  // namespace clothstream::model
