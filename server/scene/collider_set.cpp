// SPDX-License-Identifier: MIT
#include "server/scene/collider_set.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <tuple>
#include <utility>

#include "clothstream/v1/session.pb.h"
#include "server/messages/description.h"
#include "server/messages/skin_message.h"

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

// Least and largest distance of the surface from the middle. Shapes of participants are spheres, capsules and
// boxes.
float leastRadius(const model::Shape& shape) {
  if (const auto* box = std::get_if<model::Box>(&shape)) return box->size.minCoeff() / 2;
  if (const auto* capsule = std::get_if<model::Capsule>(&shape)) return capsule->radius;
  if (const auto* sphere = std::get_if<model::Sphere>(&shape)) return sphere->radius;
  return 0;
}
float largestRadius(const model::Shape& shape) {
  if (const auto* box = std::get_if<model::Box>(&shape)) return box->size.norm() / 2;
  if (const auto* capsule = std::get_if<model::Capsule>(&shape)) return capsule->radius + capsule->length / 2;
  return leastRadius(shape);
}

// At least the longest way of a point of the shape from one pose to another.
float wayOf(const model::Shape& shape, const model::Pose& from, const model::Pose& to) {
  return (to.position - from.position).norm() +
         largestRadius(shape) * to.orientation.angularDistance(from.orientation);
}

// The pose on the way from `from` to `to` after at most `step` metres.
model::Pose towards(const model::Shape& shape, const model::Pose& from, const model::Pose& to, float step) {
  const float way = wayOf(shape, from, to);
  if (way <= step) return to;
  const float share = step / way;
  return {from.position + share * (to.position - from.position),
          from.orientation.slerp(share, to.orientation)};
}

const model::Skin* skinOf(const model::Collider& collider) {
  const auto* solid = std::get_if<model::Solid>(&collider.shape);
  return solid != nullptr && (*solid)->skin ? &*(*solid)->skin : nullptr;
}

}  // namespace

ColliderSet::ColliderSet(const model::Scene& scene) {
  for (const model::Collider& collider : scene.colliders) {
    state_.scenePoses.push_back(model::poseAt(collider, 0));
    Joints& joints = state_.joints.emplace_back();
    if (const model::Skin* skin = skinOf(collider)) model::jointsAt(*skin, 0, joints.now);
  }
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
      state_.colliders.insert(place, {participant, collider, collider.pose, collider.pose, {}});
  }
}

void ColliderSet::placeJoints(std::span<const model::ColliderJoints> moved) {
  for (const model::ColliderJoints& put : moved) state_.joints[put.collider].target = put.joints;
}

// Joints that a message moves too fast appear at their new poses, like colliders.
void ColliderSet::advanceJoints(const model::Skin& skin, double endSeconds, double tickSeconds,
                                Joints& joints, simulation::MovingCollider& collider) {
  const bool byItself = joints.target.empty();
  if (byItself)
    model::jointsAt(skin, endSeconds, end_);
  else
    end_ = joints.target;
  model::compose(skin, joints.now, collider.jointsStart);
  model::compose(skin, end_, collider.jointsEnd);
  for (std::size_t i = 0; i < end_.size() && !byItself; ++i) {
    const model::Pose& start = collider.jointsStart[i];
    const model::Pose& end = collider.jointsEnd[i];
    if (startOf(start, end, tickSeconds).position == start.position &&
        startOf(start, end, tickSeconds).orientation.coeffs() == start.orientation.coeffs())
      continue;
    collider.jointsStart = collider.jointsEnd;
    break;
  }
  joints.now = end_;
}

// Elements keep the memory of their joints.
void ColliderSet::advance(const model::Scene& scene, double endSeconds,
                          std::vector<simulation::MovingCollider>& colliders) {
  const std::size_t own = scene.colliders.size();
  colliders.resize(own + state_.colliders.size());
  for (std::size_t i = 0; i < own; ++i) {
    const model::Collider& collider = scene.colliders[i];
    const model::Pose end = model::poseAt(collider, endSeconds);
    const bool byItself = !collider.motion.keys.empty();
    simulation::MovingCollider& to = colliders[i];
    to.shape = collider.shape;
    to.start = byItself ? state_.scenePoses[i] : startOf(state_.scenePoses[i], end, scene.tickSeconds());
    to.end = end;
    to.friction = collider.friction;
    if (const model::Skin* skin = skinOf(collider))
      advanceJoints(*skin, endSeconds, scene.tickSeconds(), state_.joints[i], to);
    state_.scenePoses[i] = end;
  }
  for (std::size_t i = 0; i < state_.colliders.size(); ++i) {
    Placed& collider = state_.colliders[i];
    model::Pose end = collider.now.pose;
    if (collider.yield) {
      Yield& yield = *collider.yield;
      end = yield.refused ? yield.accepted : towards(collider.now.shape, collider.before, end, yield.step);
      yield.stands = wayOf(collider.now.shape, end, collider.now.pose) > 0;
    }
    colliders[own + i] = {collider.now.shape, startOf(collider.before, end, scene.tickSeconds()), end, 1};
    collider.start = colliders[own + i].start;
    collider.before = end;
  }
}

void ColliderSet::settle(std::span<const float> depths) {
  const std::size_t own = state_.scenePoses.size();
  assert(depths.size() == own + state_.colliders.size());
  for (std::size_t i = 0; i < state_.colliders.size(); ++i) {
    Placed& collider = state_.colliders[i];
    const float depth = depths[own + i];
    const bool fits = depth <= std::min(kYieldDepth, kYieldShare * leastRadius(collider.now.shape));
    if (!collider.yield) {
      if (fits) continue;
      const float moved = wayOf(collider.now.shape, collider.start, collider.before);
      collider.yield = Yield{.accepted = collider.start,
                             .depth = depth,
                             .step = std::max(moved / 2, kLeastStep),
                             .refused = true};
      continue;
    }
    Yield& yield = *collider.yield;
    if (std::exchange(yield.refused, false)) {
      // It is back at its accepted pose. What is inside now was there before.
      yield.depth = depth;
    } else if (fits || depth < yield.depth) {
      yield.accepted = collider.before;
      yield.depth = depth;
      yield.step *= 1.5f;
      if (fits && !yield.stands) collider.yield.reset();
    } else {
      yield.refused = true;
      yield.step = std::max(yield.step / 2, kLeastStep);
    }
  }
}

void ColliderSet::restore(State state) {
  assert(state.scenePoses.size() == state_.scenePoses.size() && state.joints.size() == state_.joints.size());
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
  for (std::size_t i = 0; i < scene.colliders.size(); ++i) {
    v1::ColliderState& state = *states.Add();
    messages::write(scene.colliders[i], state_.scenePoses[i], state);
    if (const model::Skin* skin = skinOf(scene.colliders[i]))
      messages::writeJoints(*skin, state_.joints[i].now, *state.mutable_joints());
  }
  for (const Placed& collider : state_.colliders) {
    v1::ColliderState& state = *states.Add();
    model::ParticipantCollider shown = collider.now;
    if (collider.yield && collider.yield->stands) {
      shown.pose = collider.before;
      state.set_yields(true);
    }
    messages::write(shown, collider.participant, state);
  }
}

}  // namespace clothstream::scene
