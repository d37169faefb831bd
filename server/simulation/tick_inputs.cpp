// SPDX-License-Identifier: MIT
// Inputs that the scene itself gives to a tick.
#include "server/simulation/tick_inputs.h"

#include "server/model/wind.h"

namespace clothstream::simulation {

TickInputs inputsAt(const model::Scene& scene, std::uint64_t tick) {
  TickInputs inputs{model::environmentAt(scene, tick), {}};
  inputs.winds.assign(scene.winds.begin(), scene.winds.end());
  const double start = static_cast<double>(tick) * scene.tickSeconds();
  const double end = static_cast<double>(tick + 1) * scene.tickSeconds();
  for (const model::Collider& collider : scene.colliders) {
    const model::Pose before = model::poseAt(collider, start), after = model::poseAt(collider, end);
    MovingCollider& to =
        inputs.colliders.emplace_back(MovingCollider{collider.shape, before, after, collider.friction});
    if (const auto* solid = std::get_if<model::Solid>(&collider.shape); solid != nullptr && (*solid)->skin) {
      const model::Skin& skin = *(*solid)->skin;
      std::vector<model::Pose> local;
      model::jointsAt(skin, start, local);
      model::compose(skin, local, to.jointsStart);
      model::jointsAt(skin, end, local);
      model::compose(skin, local, to.jointsEnd);
    }
    jump(to, scene.tickSeconds());
  }
  std::vector<model::Pose> before;
  for (const model::Cloth& cloth : scene.cloths)
    for (const model::Attachment& attachment : cloth.attachments) {
      before.push_back(model::frameAt(scene, attachment, start));
      inputs.attachments.push_back(model::frameAt(scene, attachment, end));
    }
  inputs.carries = model::carriesOf(scene, before, inputs.attachments);
  return inputs;
}

}  // namespace clothstream::simulation
