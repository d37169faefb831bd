// SPDX-License-Identifier: MIT
// Places of grabs: points of a cloth.
#pragma once

#include "clothstream/v1/session.pb.h"
#include "server/messages/validation.h"
#include "server/model/input.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Checks that the scene has the point.
model::GrabPlace toGrabPlace(Checks& checks, const Path& path, const v1::GrabPlace& message,
                             const model::Scene& scene);

void write(const model::GrabPlace& place, v1::GrabPlace& message);

}  // namespace clothstream::messages
