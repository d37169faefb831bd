// SPDX-License-Identifier: MIT
// Converts local winds between messages and the model.
#pragma once

#include <vector>

#include "clothstream/v1/scene.pb.h"
#include "server/messages/validation.h"
#include "server/model/local_wind.h"

namespace clothstream::messages {

// Winds of a scene, with unique names.
std::vector<model::SceneWind> toSceneWinds(Checks& checks, const Path& path, const v1::Environment& message);
// Wind without a name.
model::LocalWind toLocalWind(Checks& checks, const Path& path, const v1::LocalWind& message);

void write(const model::SceneWind& wind, v1::LocalWind& message);
void write(const model::LocalWind& wind, v1::LocalWind& message);

}  // namespace clothstream::messages
