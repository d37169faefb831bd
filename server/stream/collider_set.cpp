// SPDX-License-Identifier: MIT
// Where all colliders of a scene are from tick to tick.
#include "server/stream/collider_set.h"

#include <algorithm>
#include <tuple>

#include "server/messages/description.h"

namespace clothstream::stream {
namespace {

// Where a collider that somebody moved starts: where it was, or there already if that is too far for one
// tick.
scene::Vec3 startOf(const scene::Vec3& before, const scene::Vec3& now, double tickSeconds) {
  const float reach = kMaxColliderSpeed * static_cast<float>(tickSeconds);
  return (now - before).squaredNorm() > reach * reach ? now : before;
}

}  // namespace

ColliderSet::ColliderSet(const scene::Scene& scene) {
  for (const scene::SphereCollider& collider : scene.colliders)
    scenePositions_.push_back(scene::positionAt(collider, 0));
}

void ColliderSet::place(std::uint64_t participant, std::span<const scene::ParticipantCollider> colliders) {
  std::erase_if(colliders_, [&](const Held& held) {
    return held.participant == participant &&
           std::ranges::find(colliders, held.now.id, &scene::ParticipantCollider::id) == colliders.end();
  });
  for (const scene::ParticipantCollider& collider : colliders) {
    const auto key = [](const Held& held) { return std::tuple(held.participant, held.now.id); };
    const auto place = std::ranges::lower_bound(colliders_, std::tuple(participant, collider.id), {}, key);
    if (place != colliders_.end() && key(*place) == std::tuple(participant, collider.id))
      place->now = collider;
    else
      colliders_.insert(place, {participant, collider, collider.pose.position});
  }
}

void ColliderSet::advance(const scene::Scene& scene, double endSeconds,
                          std::vector<simulation::MovingSphere>& spheres) {
  spheres.clear();
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    const scene::SphereCollider& collider = scene.colliders[i];
    const scene::Vec3 end = scene::positionAt(collider, endSeconds);
    const scene::Vec3 start =
        collider.motion.empty() ? startOf(scenePositions_[i], end, scene.tickSeconds()) : scenePositions_[i];
    spheres.push_back({.start = start, .end = end, .radius = collider.radius, .friction = collider.friction});
    scenePositions_[i] = end;
  }
  for (Held& collider : colliders_) {
    const scene::Vec3 end = collider.now.pose.position;
    spheres.push_back({.start = startOf(collider.before, end, scene.tickSeconds()),
                       .end = end,
                       .radius = collider.now.radius,
                       .friction = 1});
    collider.before = end;
  }
}

void ColliderSet::write(const scene::Scene& scene,
                        google::protobuf::RepeatedPtrField<v1::ColliderState>& states) const {
  states.Clear();
  for (std::size_t i = 0; i < scene.colliders.size(); ++i)
    messages::write(scene.colliders[i], scenePositions_[i], *states.Add());
  for (const Held& collider : colliders_) messages::write(collider.now, collider.participant, *states.Add());
}

}  // namespace clothstream::stream
