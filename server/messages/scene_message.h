// SPDX-License-Identifier: MIT
// Scenes between their message and the domain.
#pragma once

#include <optional>
#include <string>

#include "clothstream/v1/scene.pb.h"
#include "server/messages/field_error.h"
#include "server/messages/mesh_message.h"
#include "server/scene/scene.h"

namespace clothstream::messages {

// Applies the defaults of scene.proto and checks everything: ranges, names and their uniqueness, pins inside
// their grid, meshes, rates, the number of nodes, and that the integrator is stable with these substeps.
// Meshes may be named as files only where there is a reader.
[[nodiscard]] Result<scene::Scene> toScene(const v1::Scene& message, const MeshReader& readMesh = {});

// Every field set, defaults too, meshes in full. toScene() of it gives the scene back.
v1::Scene toMessage(const scene::Scene& scene);
v1::Normals toMessage(scene::Normals normals);

// What to say of a scene whose integrator is not stable with its substeps; nullopt if it is.
std::optional<std::string> instability(const scene::Scene& scene);

}  // namespace clothstream::messages
