// SPDX-License-Identifier: MIT
// Converts the message of a cloth to the model.
#pragma once

#include <string>
#include <vector>

#include "clothstream/v1/scene.pb.h"
#include "clothstream/v1/session.pb.h"
#include "server/messages/mesh_message.h"
#include "server/messages/scene_limits.h"
#include "server/messages/validation.h"
#include "server/model/material.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Applies defaults and checks what concerns this cloth alone. Its skin is read once the colliders are known
// (cloth_skin_message.h); `vertices` is what that needs. Refuses a mesh file if there is no reader. Adds to
// `repairs` if something was repaired. Throws model::Cancelled.
model::Cloth toCloth(Checks& checks, const Path& path, const v1::Cloth& message, const MeshReader& readMesh,
                     const SceneLimits& most, ClothVertices& vertices, std::vector<v1::MeshRepair>& repairs);
// A node is pinned or attached at most once.
void checkAttached(Checks& checks, const Path& path, const model::Cloth& cloth);

// nullptr and a failed check, whose text lists all materials, if no material has this name.
const model::Material* toMaterial(Checks& checks, const Path& path, const std::string& name);

}  // namespace clothstream::messages
