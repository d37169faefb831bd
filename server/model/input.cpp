// SPDX-License-Identifier: MIT
// Applies parameter changes to a scene.
#include "server/model/input.h"

#include <algorithm>
#include <cassert>

#include "server/model/material.h"

namespace clothstream::model {
namespace {

template <typename T>
void assign(T& field, const std::optional<T>& value) {
  if (value) field = *value;
}

void apply(Cloth& cloth, const ClothChange& change) {
  if (change.material) makeOf(*findMaterial(*change.material), cloth);
  parameters::applyNumbers(
      change.numbers, [&](parameters::ClothNumber number) { return parameters::memberOf(cloth, number); });
  assign(cloth.solver, change.solver);
  if (change.arealMass) cloth.mass = static_cast<float>(double{*change.arealMass} * areaOf(cloth));
}

// A motion that ends leaves the part of the pose that does not change at the pose of the scene.
void apply(Collider& collider, const ColliderChange& change) {
  if (change.position || change.orientation) collider.motion.keys.clear();
  assign(collider.pose.position, change.position);
  assign(collider.pose.orientation, change.orientation);
  assign(collider.friction, change.friction);
  if (float* radius = radiusOf(collider.shape)) assign(*radius, change.radius);
  if (auto* capsule = std::get_if<Capsule>(&collider.shape)) assign(capsule->length, change.length);
  if (auto* box = std::get_if<Box>(&collider.shape)) assign(box->size, change.size);
}

}  // namespace

void applyChange(Scene& scene, const ParameterChange& change) {
  assign(scene.environment.gravity, change.gravity);
  assign(scene.environment.wind, change.wind);
  assign(scene.environment.airDensity, change.airDensity);
  assign(scene.environment.gust, change.gust);
  for (const ClothChange& clothChange : change.cloths)
    for (Cloth& cloth : scene.cloths)
      if (clothChange.name.empty() || clothChange.name == cloth.name) apply(cloth, clothChange);
  for (const ColliderChange& colliderChange : change.colliders) {
    const auto collider = std::ranges::find(scene.colliders, colliderChange.name, &Collider::name);
    assert(collider != scene.colliders.end());
    apply(*collider, colliderChange);
  }
}

}  // namespace clothstream::model
