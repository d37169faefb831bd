// SPDX-License-Identifier: MIT
// Poses that jump between two ticks, and cloth that goes along.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/pose.h"
#include "server/model/scene.h"

namespace clothstream::model {

// Maximum rotation in a tick, as the cosine of half the angle (120 degrees).
inline constexpr float kMaxTurn = 0.5f;

// Whether a body that is at these poses at a tick's start and end is too fast to be in between meanwhile: it
// moves faster than kMaxAttachmentSpeed, or turns by more than kMaxTurn. `radius` is the greatest distance of
// its points from the origin of the pose, in metres; they may move twice as fast. 0 leaves them out.
bool hasJumped(const Pose& before, const Pose& now, double tickSeconds, float radius = 0);

// Whether any of these poses jumps.
bool hasJumped(std::span<const Pose> before, std::span<const Pose> now, double tickSeconds);

// Rigid motion of a whole cloth at the start of a tick. It takes `from` to `to`.
struct Carry {
  std::uint32_t cloth = 0;
  Pose from, to;
};

// The cloths that attachments carry along in a tick. A cloth goes along with its first attachment if that one
// jumps, or any of its attachments must jump; if no other attachment is too fast after that motion; and if it
// is neither pinned nor follows joints, which take it along themselves. `before` and `now` are the poses of
// all attachments at the tick's start and end, in the order of the cloths. `told` has the indices of those
// that must jump, however short their way is.
std::vector<Carry> carriesOf(const Scene& scene, std::span<const Pose> before, std::span<const Pose> now,
                             std::span<const std::size_t> told = {});

}  // namespace clothstream::model
