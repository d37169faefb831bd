// SPDX-License-Identifier: MIT
// Everything that is kept of a scene, as serialised messages, and back.
#pragma once

#include <optional>
#include <string>

#include "clothstream/v1/fleet.pb.h"
#include "server/saved_state/database.h"
#include "server/saved_state/state_message.h"
#include "server/scene/live_scene.h"

namespace clothstream::saved_state {

// Session of a scene; logs it if it is damaged, and returns an empty one.
v1::SavedSession parseSession(const std::string& name, const SceneContents& contents);
// Adds session and checkpoint. A part that cannot be used is left out, and logged.
void addSessionAndCheckpoint(const SceneContents& contents, scene::SavedScene& saved);
// A scene that a peer created.
[[nodiscard]] Read<scene::SavedScene> toCreated(const SceneContents& contents);

// Session of a running scene. `parameters` is its definition without meshes.
v1::SavedSession sessionOf(const scene::LiveScene& live, const scene::SavedRoster& roster,
                           const v1::Scene& parameters);

// Definition of a scene that goes to another server, and its session with its state. The state may be absent.
v1::SavedParts definitionOf(const scene::LiveScene& live);
v1::SavedParts stateOf(const scene::LiveScene& live, const std::optional<scene::Checkpoint>& checkpoint);
// A scene that comes from another server.
[[nodiscard]] Read<scene::SavedScene> toSaved(v1::SavedParts parts);
// The same, with this definition. A state that cannot be used is an error.
[[nodiscard]] Read<scene::SavedScene> toSaved(v1::SavedParts parts, const model::Scene& start);

}  // namespace clothstream::saved_state
