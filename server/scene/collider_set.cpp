// SPDX-License-Identifier: MIT
#include "server/scene/collider_set.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "server/messages/description.h"

namespace clothstream::scene {
namespace {

// Start pose of a collider that was moved by a message: its former pose, or the new one if the motion exceeds
// the limits of one tick.
model::Pose startOf(const model::Pose& before, const model::Pose& now, double tickSeconds) {
  const float reach = kMaxColliderSpeed * static_cast<float>(tickSeconds);
  const bool jumped = (now.position - before.position).squaredNorm() > reach * reach ||
                      std::abs(now.orientation.dot(before.orientation)) < kMaxColliderTurn;
  return jumped ? now : before;
}

}  // namespace

ColliderSet::ColliderSet(const model::Scene& scene) {
  for (const model::Collider& collider : scene.colliders)
    state_.scenePoses.push_back(model::poseAt(collider, 0));
}

void ColliderSet::place(std::uint64_t participant, std::span<const model::ParticipantCollider> colliders) {
  std::erase_if(state_.colliders, [&](const Placed& placed) {
    return placed.participant == participant &&
           std::ranges::find(colliders, placed.now.id, &model::ParticipantCollider::id) == colliders.end();
  });
  for (const model::ParticipantCollider& collider : colliders) {
    const auto key = [](const Placed& placed) { return std::tuple(placed.participant, placed.now.id); };
    const auto place =
        std::ranges::lower_bound(state_.colliders, std::tuple(participant, collider.id), {}, key);
    if (place != state_.colliders.end() && key(*place) == std::tuple(participant, collider.id))
      place->now = collider;
    else
      state_.colliders.insert(place, {participant, collider, collider.pose});
  }
}

void ColliderSet::advance(const model::Scene& scene, double endSeconds,
                          std::vector<simulation::MovingCollider>& colliders) {
  colliders.clear();
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const model::Collider& collider = scene.colliders[i];
    const model::Pose end = model::poseAt(collider, endSeconds);
    const bool byItself = !collider.motion.keys.empty();
    colliders.push_back(
        {collider.shape,
         byItself ? state_.scenePoses[i] : startOf(state_.scenePoses[i], end, scene.tickSeconds()), end,
         collider.friction});
    state_.scenePoses[i] = end;
  }
  for (Placed& collider : state_.colliders) {
    const model::Pose& end = collider.now.pose;
    colliders.push_back({collider.now.shape, startOf(collider.before, end, scene.tickSeconds()), end, 1});
    collider.before = end;
  }
}

void ColliderSet::restore(State state) {
  assert(state.scenePoses.size() == state_.scenePoses.size());
  state_ = std::move(state);
}

ColliderSet::Identity ColliderSet::identity(std::size_t index) const {
  if (index < state_.scenePoses.size()) return {0, static_cast<std::uint32_t>(index)};
  const Placed& placed = state_.colliders[index - state_.scenePoses.size()];
  return {placed.participant, placed.now.id};
}

void ColliderSet::write(const model::Scene& scene, v1::Frame& frame) const {
  auto& states = *frame.mutable_colliders();
  states.Clear();
  for (std::size_t i = 0; i < scene.colliders.size(); ++i)
    messages::write(scene.colliders[i], state_.scenePoses[i], *states.Add());
  for (const Placed& collider : state_.colliders)
    messages::write(collider.now, collider.participant, *states.Add());
}

}  // namespace clothstream::scene
