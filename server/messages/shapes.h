// SPDX-License-Identifier: MIT
// Shapes of colliders between messages and domain types.
#pragma once

#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/messages/validation.h"
#include "server/model/collider.h"

namespace clothstream::messages {

model::Shape toShape(Checks& checks, const Path& path, const v1::Collider& message);
model::Shape toShape(Checks& checks, const Path& path, const v1::ParticipantCollider& message);

// Replaces the message's shape.
void write(const model::Shape& shape, v1::Collider& message);
// The same, but for a hull, of which a state has at most the mention: hulls are part of the description.
void write(const model::Shape& shape, v1::ColliderState& message);
void writeHull(const model::ConvexHull& hull, v1::ConvexHull& message);

}  // namespace clothstream::messages
