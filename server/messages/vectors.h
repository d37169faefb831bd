// SPDX-License-Identifier: MIT
// Vectors, poses and springs between messages and domain types.
#pragma once

#include "clothstream/v1/scene.pb.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"

namespace clothstream::messages {

model::Vec3 toVec3(Checks& checks, const Path& path, const v1::Vec3& message, Range allowed);
// Absent or all zero: no rotation. Otherwise of length 1 within kUnitTolerance; normalised.
model::Quaternion toQuaternion(Checks& checks, const Path& path, const v1::Quaternion& message);
model::Pose toPose(Checks& checks, const Path& path, const v1::Pose& message);
model::Spring toSpring(Checks& checks, const Path& path, const v1::Spring& message);

void write(const model::Vec3& value, v1::Vec3& message);
void write(const model::Quaternion& value, v1::Quaternion& message);
void write(const model::Pose& value, v1::Pose& message);
void write(const model::Spring& value, v1::Spring& message);

}  // namespace clothstream::messages
