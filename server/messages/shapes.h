// SPDX-License-Identifier: MIT
// Converts shapes of colliders between messages and the model.
#pragma once

#include "clothstream/v1/recording.pb.h"
#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/messages/mesh_message.h"
#include "server/messages/validation.h"
#include "server/model/collider.h"

namespace clothstream::messages {

// Refuses the file of a mesh if there is no reader.
model::Shape toShape(Checks& checks, const Path& path, const v1::Collider& message,
                     const MeshReader& readMesh = {});
model::Shape toShape(Checks& checks, const Path& path, const v1::ParticipantCollider& message);

// Fails at `path` if one end of the capsule would be inside the other.
void checkEnds(Checks& checks, const Path& path, const model::Capsule& capsule);

// Replaces the shape of the message.
void write(const model::Shape& shape, v1::Collider& message);
// Replaces the shape of the message. Hulls and meshes are left out; the description has them.
void write(const model::Shape& shape, v1::ColliderState& message);
// Replaces the shape of the message. Hulls and meshes are left out; the scene has them.
void write(const model::Shape& shape, v1::AppliedCollider& message);
void writeHull(const model::ConvexHull& hull, v1::ConvexHull& message);

}  // namespace clothstream::messages
