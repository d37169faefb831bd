// SPDX-License-Identifier: MIT
#include "server/simulation/collision/moving_collider.h"

#include "server/model/jump.h"

namespace clothstream::simulation {

void jump(MovingCollider& collider, double tickSeconds, bool jointsMust) {
  const bool moves = model::hasJumped(collider.start, collider.end, tickSeconds);
  const bool bends = jointsMust || model::hasJumped(collider.jointsStart, collider.jointsEnd, tickSeconds);
  collider.jumped = moves || bends;
  if (!collider.jumped) return;
  collider.before = collider.start;
  collider.jointsBefore = collider.jointsStart;
  if (moves) collider.start = collider.end;
  if (bends) collider.jointsStart = collider.jointsEnd;
}

}  // namespace clothstream::simulation
