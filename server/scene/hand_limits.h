// SPDX-License-Identifier: MIT
// Limits of what participants do to cloth in one tick. They bound the energy that a tick can get. Hands,
// heads and trackers stay far below them.
#pragma once

#include "server/model/collider.h"
#include "server/model/scene.h"

namespace clothstream::scene {

// Maximum speed of a grab that a participant moves, m/s. A collider that is faster has jumped
// (model::hasJumped).
inline constexpr float kMaxHandSpeed = model::kMaxAttachmentSpeed;
// Depth of a shape that appears, m: cloth inside it leaves by at most this way. Its depth then grows by
// kGrowth, m/s.
inline constexpr float kMaxAppearance = 0.1f;
inline constexpr float kGrowth = 3;
// Force that every grab may have, N. Heavier cloth may be held more strongly, by all grabs together: all of
// it gets kMaxHandSpeed in kPullSeconds, or in one tick if that is longer.
inline constexpr float kLeastMaxForce = 20;
inline constexpr float kPullSeconds = 0.1f;

// At least the longest way of a point that is at most `radius` from the origin of the pose.
float wayOf(float radius, const model::Pose& from, const model::Pose& to);
// The pose on the way from `from` to `to`, after at most `step` metres of such a point.
model::Pose towards(float radius, const model::Pose& from, const model::Pose& to, float step);

// Maximum force of a grab on the cloth of this scene, N. All grabs together may have as much, or
// kLeastMaxForce each if that is more.
float maxGrabForce(const model::Scene& scene);

}  // namespace clothstream::scene
