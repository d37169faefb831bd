// SPDX-License-Identifier: MIT
#include "server/scene/joint_follower.h"

#include <cassert>
#include <utility>

namespace clothstream::scene {
namespace {

// The farthest way of a vertex does not grow evenly along the way of the poses.
constexpr int kTries = 4;

}  // namespace

JointFollower::JointFollower(model::Solid solid)
    : solid_(std::move(solid)),
      inverseRests_(model::inverseRests(*solid_->skin)),
      bounds_(model::skinBounds(solid_->skin->vertices, solid_->skin->joints.size(), solid_->vertices)),
      from_(inverseRests_.size()),
      to_(inverseRests_.size()) {}

void JointFollower::follow(std::span<const model::Pose> now, std::span<const model::Pose> target, float most,
                           std::vector<model::Pose>& end) {
  assert(now.size() == target.size());
  end.assign(target.begin(), target.end());
  double part = 1;
  for (int i = 0; i < kTries; ++i) {
    const float way = farthest(now, end);
    if (way <= most) return;
    part *= double{most} / way;
    for (std::size_t joint = 0; joint < end.size(); ++joint)
      end[joint] = model::between(now[joint], target[joint], part);
  }
}

float JointFollower::farthest(std::span<const model::Pose> now, std::span<const model::Pose> end) {
  model::compose(*solid_->skin, now, composed_);
  model::jointTransforms(inverseRests_, composed_, from_);
  model::compose(*solid_->skin, end, composed_);
  model::jointTransforms(inverseRests_, composed_, to_);
  return model::motionBetween(bounds_, from_, to_).farthest;
}

}  // namespace clothstream::scene
