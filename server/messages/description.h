// SPDX-License-Identifier: MIT
// What a client needs before its first frame, and how large things are cut for the wire.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "clothstream/v1/session.pb.h"
#include "server/model/input.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Overwrites every field of `state`, so that one message can be filled again each tick. A participant's
// collider is named by its id. A hull's shape is left out.
void write(const model::Collider& collider, const model::Pose& pose, v1::ColliderState& state);
void write(const model::ParticipantCollider& collider, std::uint64_t participantId, v1::ColliderState& state);

// What a cloth's vertices, triangles and texture coordinates take in a description.
std::size_t geometryBytes(const model::Cloth& cloth);

// With the scene's own colliders, hulls too, as they are at `seconds` of simulated time. The scene must be
// valid.
v1::StreamDescription toDescription(const model::Scene& scene, std::uint32_t epoch, std::uint32_t codec,
                                    double seconds);
// Its two parts, which one after the other on the wire are the whole: `cloths`, most of its bytes, which stay
// as they are while the scene runs, and all else.
v1::StreamDescription clothsOfDescription(const model::Scene& scene);
v1::StreamDescription descriptionWithoutCloths(const model::Scene& scene, std::uint32_t epoch,
                                               std::uint32_t codec, double seconds);

// A scene as a list shows it; who is in it, and whether it runs, only the caller knows.
v1::SceneSummary toSummary(const model::Scene& scene);

// How many pieces a content of so many bytes has: of limits::kMaxChunkBytes, the last may be shorter; one
// empty piece for empty content.
std::size_t chunkCount(std::size_t contentBytes);
// One of them, of the content that these parts are one after the other; it has at most
// limits::kMaxContentBytes.
v1::Chunk toChunk(std::uint64_t contentId, v1::ContentKind kind, std::span<const std::string_view> parts,
                  std::size_t index);

}  // namespace clothstream::messages
