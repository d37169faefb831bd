// SPDX-License-Identifier: MIT
// Ticks of the reference.
#include "server/reference/reference_simulation.h"

namespace clothstream::reference {

TickInputs inputsAt(const scene::Scene& scene, std::uint64_t tick) {
  TickInputs inputs{scene.environment, {}};
  const double start = static_cast<double>(tick) * scene.tickSeconds();
  const double end = static_cast<double>(tick + 1) * scene.tickSeconds();
  for (const scene::Collider& collider : scene.colliders)
    inputs.colliders.push_back({collider.shape, toPose(scene::poseAt(collider, start)),
                                toPose(scene::poseAt(collider, end)), collider.friction});
  return inputs;
}

ReferenceSimulation::ReferenceSimulation(const scene::Scene& scene)
    : scene_(scene), cloths_(scene.cloths.begin(), scene.cloths.end()) {}

void ReferenceSimulation::tick(const TickInputs& inputs) {
  for (std::uint32_t index = 0; index < scene_.substeps; ++index) substep(inputs, index);
  ++ticks_;
}

void ReferenceSimulation::tick() {
  tick(inputsAt(scene_, ticks_));
}

void ReferenceSimulation::substep(const TickInputs& inputs, std::uint32_t index) {
  for (ReferenceCloth& cloth : cloths_) {
    before_.assign(cloth.positions().begin(), cloth.positions().end());
    cloth.integrate(inputs.environment, scene_.integrator, scene_.substepSeconds());
    for (const MovingCollider& collider : inputs.colliders)
      cloth.collide(collider.shape,
                    stepOf(collider.start, collider.end, index, scene_.substeps, scene_.tickSeconds()),
                    collider.friction, before_);
  }
}

}  // namespace clothstream::reference
