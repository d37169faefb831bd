// SPDX-License-Identifier: MIT
// Applies parameter changes to a scene.
#include "server/model/input.h"

#include <algorithm>
#include <cassert>

#include "proto/parameters/apply_change.h"
#include "server/model/material.h"

namespace clothstream::model {
namespace {

using parameters::assign;

void apply(const ClothChange& change, Cloth& cloth) {
  if (change.material) {
    const Solver solver = cloth.solver;
    makeOf(*findMaterial(*change.material), cloth);
    // It takes the stiff springs of every material with fewer substeps than xpbd.
    if (solver.kind == SolverKind::implicitEuler) cloth.solver = solver;
  }
  parameters::applyNumbers(
      change.numbers, [&](parameters::ClothNumber number) { return parameters::memberOf(cloth, number); });
  assign(cloth.solver, change.solver);
  if (change.arealMass) cloth.mass = static_cast<float>(double{*change.arealMass} * areaOf(cloth));
}

// A motion that ends leaves the part of the pose that does not change at the pose of the scene.
void apply(const ColliderChange& change, Collider& collider) {
  if (change.position || change.orientation) collider.motion.keys.clear();
  assign(collider.pose.position, change.position);
  assign(collider.pose.orientation, change.orientation);
  assign(collider.friction, change.friction);
  if (float* radius = radiusOf(collider.shape)) assign(*radius, change.radius);
  if (auto* capsule = std::get_if<Capsule>(&collider.shape)) assign(capsule->length, change.length);
  if (auto* box = std::get_if<Box>(&collider.shape)) assign(box->size, change.size);
}

}  // namespace

void applyChange(Environment& environment, const parameters::EnvironmentChange& change) {
  for (const parameters::EnvironmentParameter& parameter : parameters::kEnvironmentParameters)
    if (const auto& value = change[parameter.row])
      for (std::uint32_t i = 0; i < parameter.numbers.size(); ++i)
        numberOf(environment, parameter.row, i) = (*value)[i];
}

void applyChange(Scene& scene, const ParameterChange& change) {
  applyChange(scene.environment, change.environment);
  parameters::applyToCloths(change.cloths, scene.cloths,
                            [](const ClothChange& clothChange, Cloth& cloth) { apply(clothChange, cloth); });
  for (const ColliderChange& colliderChange : change.colliders) {
    const auto collider = std::ranges::find(scene.colliders, colliderChange.name, &Collider::name);
    assert(collider != scene.colliders.end());
    apply(colliderChange, *collider);
  }
}

}  // namespace clothstream::model
