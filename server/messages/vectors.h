// SPDX-License-Identifier: MIT
// Converts vectors, poses and motions between messages and the model.
#pragma once

#include "clothstream/v1/scene.pb.h"
#include "server/messages/validation.h"
#include "server/model/scene.h"

namespace clothstream::messages {

model::Vec3 toVec3(Checks& checks, const Path& path, const v1::Vec3& message, Range allowed);
// Absent or all zero means no rotation. Otherwise the length must be 1 within kUnitTolerance. The result is
// normalised.
model::Quaternion toQuaternion(Checks& checks, const Path& path, const v1::Quaternion& message);
model::Pose toPose(Checks& checks, const Path& path, const v1::Pose& message);

// Keys without an orientation have this one.
model::Motion toMotion(Checks& checks, const Path& path, const v1::Motion& message,
                       const model::Quaternion& orientation);

void write(const model::Vec3& value, v1::Vec3& message);
void write(const model::Quaternion& value, v1::Quaternion& message);
void write(const model::Pose& value, v1::Pose& message);
void write(const model::Motion& value, v1::Motion& message);

}  // namespace clothstream::messages
