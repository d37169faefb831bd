// SPDX-License-Identifier: MIT
// Ticks of the reference.
#include "server/reference/reference_simulation.h"

namespace clothstream::reference {

TickInputs inputsAt(const scene::Scene& scene, std::uint64_t tick) {
  TickInputs inputs{scene.environment, {}};
  const double start = static_cast<double>(tick) * scene.tickSeconds();
  const double end = static_cast<double>(tick + 1) * scene.tickSeconds();
  for (const scene::SphereCollider& collider : scene.colliders)
    inputs.spheres.push_back({scene::positionAt(collider, start).cast<double>(),
                              scene::positionAt(collider, end).cast<double>(), collider.radius,
                              collider.friction});
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
    cloth.integrate(inputs.environment, scene_.integrator, scene_.substepSeconds());
    for (const MovingSphere& sphere : inputs.spheres) {
      const Vec3 path = sphere.end - sphere.start;
      const Vec3 centre = sphere.start + path * (index + 1.0) / scene_.substeps;
      cloth.collide(centre, path / scene_.tickSeconds(), sphere.radius, sphere.friction);
    }
  }
}

}  // namespace clothstream::reference
