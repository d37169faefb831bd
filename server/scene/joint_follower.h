// SPDX-License-Identifier: MIT
// Moves the joints of a mesh towards poses of a message, at a speed that bodies have.
#pragma once

#include <span>
#include <vector>

#include "server/model/collider.h"
#include "server/model/skin.h"

namespace clothstream::scene {

// Maximum speed of a vertex that joints move by a message, m/s: that of a fist. Bodies that follow faster
// messages reach their poses some ticks later.
inline constexpr float kMaxBodySpeed = 12;

// Belongs to one mesh with a skin. Allocates nothing after the first call.
class JointFollower {
 public:
  explicit JointFollower(model::Solid solid);

  // Writes poses to `end` that are on the way from `now` to `target`: all of the way if no vertex moves
  // farther than `most` metres, else the part in which the fastest vertex moves about that far. All have one
  // pose for each joint, relative to its parent.
  void follow(std::span<const model::Pose> now, std::span<const model::Pose> target, float most,
              std::vector<model::Pose>& end);

 private:
  float farthest(std::span<const model::Pose> now, std::span<const model::Pose> end);

  model::Solid solid_;
  std::vector<model::JointFrame> inverseRests_;
  model::SkinBounds bounds_;
  std::vector<model::Pose> composed_;
  std::vector<model::Transform> from_, to_;
};

}  // namespace clothstream::scene
