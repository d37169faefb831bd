// SPDX-License-Identifier: MIT
// Converts scenes, sessions and checkpoints between their messages and the model, exact to the bit.
#pragma once

#include <string>

#include <tl/expected.hpp>

#include "clothstream/v1/saved_state.pb.h"
#include "server/model/scene.h"
#include "server/scene/checkpoint.h"
#include "server/scene/scene_terms.h"

namespace clothstream::saved_state {

template <typename T>
using Read = tl::expected<T, std::string>;  // the error says what is wrong

// Definition of a scene that a peer created, or size and CRC of one that the server starts with.
v1::SavedScene toMessage(const model::Scene& start, const scene::SceneTerms& terms);
// Whether the message is of this scene, which the server starts with.
bool isOf(const v1::SavedScene& message, const model::Scene& start);
// Definition of a created scene.
[[nodiscard]] Read<model::Scene> toScene(const v1::Scene& message);

// Session without the pause and the reset of its scene.
v1::SavedSession toMessage(const scene::SavedRoster& roster, const v1::Scene& parameters);
scene::SavedRoster toRoster(const v1::SavedSession& message);

v1::SavedCheckpoint toMessage(const scene::Checkpoint& checkpoint);
// `start` is the definition of the scene.
[[nodiscard]] Read<scene::Checkpoint> toCheckpoint(const v1::SavedCheckpoint& message,
                                                   const model::Scene& start);

// Scene with these parameters and the meshes of `start`.
[[nodiscard]] Read<model::Scene> withParameters(const v1::Scene& parameters, const model::Scene& start);

}  // namespace clothstream::saved_state
