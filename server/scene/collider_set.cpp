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
#include "server/model/jump.h"
#include "server/model/same_pose.h"
#include "server/scene/hand_limits.h"

namespace clothstream::scene {
namespace {

const model::Skin* skinOf(const model::Collider& collider) {
  const auto* solid = std::get_if<model::Solid>(&collider.shape);
  return solid != nullptr && (*solid)->skin ? &*(*solid)->skin : nullptr;
}

}  // namespace

ColliderSet::ColliderSet(const model::Scene& scene) {
  for (const model::Collider& collider : scene.colliders) {
    state_.scenePoses.push_back(model::poseAt(collider, 0));
    Joints& joints = state_.joints.emplace_back();
    std::optional<JointFollower>& follower = followers_.emplace_back();
    const model::Skin* const skin = skinOf(collider);
    if (skin == nullptr) continue;
    model::jointsAt(*skin, 0, joints.now);
    follower.emplace(std::get<model::Solid>(collider.shape));
  }
  start_ = kept_ = followed();
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
  for (const model::ColliderJoints& put : moved) {
    Joints& joints = state_.joints[put.collider];
    joints.target = put.joints;
    joints.jumps = joints.jumps || put.jumps;
  }
}

bool ColliderSet::isTouched() const {
  return !state_.colliders.empty() ||
         std::ranges::any_of(state_.joints, [](const Joints& joints) { return !joints.target.empty(); });
}

void ColliderSet::letGo() {
  state_.colliders.clear();
  for (Joints& joints : state_.joints)
    if (!joints.target.empty()) joints = {};
}

void ColliderSet::advanceJoints(const model::Skin& skin, double endSeconds, double tickSeconds,
                                std::size_t index, simulation::MovingCollider& collider) {
  Joints& joints = state_.joints[index];
  if (joints.target.empty()) {
    model::jointsAt(skin, endSeconds, end_);
    if (joints.now.empty()) joints.now = end_;  // after letGo()
  } else {
    if (joints.now.empty()) joints.now = joints.target;
    if (joints.jumps)
      end_ = joints.target;
    else
      followers_[index]->follow(joints.now, joints.target, kMaxBodySpeed * static_cast<float>(tickSeconds),
                                end_);
  }
  model::compose(skin, joints.now, collider.jointsStart);
  model::compose(skin, end_, collider.jointsEnd);
  joints.now = end_;
}

void ColliderSet::takeAlong(const model::Skin& skin, std::size_t index,
                            simulation::MovingCollider& collider) const {
  collider.before = kept_.colliders[index];
  model::compose(skin, kept_.joints[index], collider.jointsBefore);
  // A cloth that is where it was is not even rounded.
  collider.jumped = !model::isSame(collider.before, collider.start) ||
                    !std::ranges::equal(collider.jointsBefore, collider.jointsStart, model::isSame);
}

// Elements keep the memory of their joints.
void ColliderSet::advance(const model::Scene& scene, double endSeconds,
                          std::vector<simulation::MovingCollider>& colliders) {
  const std::size_t own = scene.colliders.size();
  colliders.resize(own + state_.colliders.size());
  for (std::size_t i = 0; i < own; ++i) {
    const model::Collider& collider = scene.colliders[i];
    const model::Pose end = model::poseAt(collider, endSeconds);
    simulation::MovingCollider& to = colliders[i];
    to.shape = collider.shape;
    to.start = state_.scenePoses[i];
    to.end = end;
    to.friction = collider.friction;
    const model::Skin* const skin = skinOf(collider);
    if (skin != nullptr) advanceJoints(*skin, endSeconds, scene.tickSeconds(), i, to);
    simulation::jump(to, scene.tickSeconds(), std::exchange(state_.joints[i].jumps, false));
    if (skin != nullptr && takesAlong_) takeAlong(*skin, i, to);
    state_.scenePoses[i] = end;
  }
  takesAlong_ = false;
  for (std::size_t i = 0; i < state_.colliders.size(); ++i) {
    Placed& collider = state_.colliders[i];
    const float radius = model::reachOf(collider.now.shape);
    model::Pose end = collider.now.pose;
    if (collider.yield) {
      Yield& yield = *collider.yield;
      end = yield.refused ? yield.accepted : towards(radius, collider.before, end, yield.step);
      yield.stands = wayOf(radius, end, collider.now.pose) > 0;
    }
    const bool jumped = model::hasJumped(collider.before, end, scene.tickSeconds(), radius);
    const float grown = jumped || collider.depth == 0
                            ? 0
                            : collider.depth + kGrowth * static_cast<float>(scene.tickSeconds());
    collider.depth = std::min(model::largestDepth(collider.now.shape), std::max(grown, kMaxAppearance));
    collider.start = jumped ? end : collider.before;
    collider.before = end;
    colliders[own + i] = {model::thinned(collider.now.shape, collider.depth), collider.start, end, 1};
  }
}

void ColliderSet::settle(std::span<const float> depths) {
  const std::size_t own = state_.scenePoses.size();
  assert(depths.size() == own + state_.colliders.size());
  for (std::size_t i = 0; i < state_.colliders.size(); ++i) {
    Placed& collider = state_.colliders[i];
    const float depth = depths[own + i];
    const bool fits = depth <= std::min(kYieldDepth, kYieldShare * model::largestDepth(collider.now.shape));
    if (!collider.yield) {
      if (fits) continue;
      const float moved = wayOf(model::reachOf(collider.now.shape), collider.start, collider.before);
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
  kept_ = followed();
}

ColliderSet::Followed ColliderSet::followed() const {
  Followed followed{.colliders = state_.scenePoses, .joints = {}};
  for (const Joints& joints : state_.joints) followed.joints.push_back(joints.now);
  return followed;
}

// Reuses the memory of the former ones.
void ColliderSet::keepFollowed() {
  kept_.colliders = state_.scenePoses;
  for (std::size_t i = 0; i < state_.joints.size(); ++i) kept_.joints[i] = state_.joints[i].now;
}

void ColliderSet::clothsWentBack(const Followed& then) {
  kept_ = then;
  clothsWentBack();
}

ColliderSet::Identity ColliderSet::identity(std::size_t index) const {
  if (index < state_.scenePoses.size()) return {0, static_cast<std::uint32_t>(index)};
  const Placed& placed = state_.colliders[index - state_.scenePoses.size()];
  return {placed.participant, placed.now.id};
}

// Sets every field of each element. Protobuf would free the fields of elements that are cleared.
void ColliderSet::write(const model::Scene& scene, v1::Frame& frame) const {
  const std::size_t own = scene.colliders.size();
  auto& states = *frame.mutable_colliders();
  const auto count = static_cast<int>(own + state_.colliders.size());
  while (states.size() > count) states.RemoveLast();
  while (states.size() < count) states.Add();
  for (std::size_t i = 0; i < own; ++i) {
    v1::ColliderState& state = states[static_cast<int>(i)];
    messages::write(scene.colliders[i], state_.scenePoses[i], state);
    state.clear_joints();
    if (const model::Skin* skin = skinOf(scene.colliders[i]))
      messages::writeJoints(*skin, state_.joints[i].now, *state.mutable_joints());
    state.set_yields(false);
  }
  for (std::size_t i = 0; i < state_.colliders.size(); ++i) {
    const Placed& collider = state_.colliders[i];
    v1::ColliderState& state = states[static_cast<int>(own + i)];
    const bool yields = collider.yield && collider.yield->stands;
    model::ParticipantCollider shown = collider.now;
    shown.shape = model::thinned(shown.shape, collider.depth);
    if (yields) shown.pose = collider.before;
    messages::write(shown, collider.participant, state);
    state.clear_joints();
    state.set_yields(yields);
  }
}

}  // namespace clothstream::scene
