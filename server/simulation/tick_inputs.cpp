// SPDX-License-Identifier: MIT
// What a scene by itself brings to a tick.
#include "server/scene/wind.h"
#include "server/simulation/cloth_simulation.h"

namespace clothstream::simulation {

TickInputs inputsAt(const scene::Scene& scene, std::uint64_t tick) {
  TickInputs inputs{scene::environmentAt(scene, tick), {}};
  const double start = static_cast<double>(tick) * scene.tickSeconds();
  const double end = static_cast<double>(tick + 1) * scene.tickSeconds();
  for (const scene::Collider& collider : scene.colliders)
    inputs.colliders.push_back(
        {collider.shape, scene::poseAt(collider, start), scene::poseAt(collider, end), collider.friction});
  for (const scene::Cloth& cloth : scene.cloths)
    for (const scene::Attachment& attachment : cloth.attachments)
      inputs.attachments.push_back(scene::frameAt(scene, attachment, end));
  return inputs;
}

}  // namespace clothstream::simulation
