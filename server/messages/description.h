// SPDX-License-Identifier: MIT
// Stream descriptions, collider states and chunks of large content.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "clothstream/v1/session.pb.h"
#include "server/model/input.h"
#include "server/model/scene.h"

namespace clothstream::messages {

// Overwrites every field of `state`, so that one message can be reused each tick. A collider of a participant
// has an id but no name. The shape of a hull is left out.
void write(const model::Collider& collider, const model::Pose& pose, v1::ColliderState& state);
void write(const model::ParticipantCollider& collider, std::uint64_t participantId, v1::ColliderState& state);

// Bytes of a cloth's vertices, triangles and texture coordinates in a description.
std::size_t geometryBytes(const model::Cloth& cloth);

// Includes the colliders of the scene, with hulls, at `seconds` of simulated time. The scene must be valid.
v1::StreamDescription toDescription(const model::Scene& scene, std::uint32_t epoch, std::uint32_t codec,
                                    double seconds);
// The two parts of a description. Their bytes, concatenated, are the whole description. The cloths are most
// of the bytes and do not change while the scene runs.
v1::StreamDescription clothsOfDescription(const model::Scene& scene);
v1::StreamDescription descriptionWithoutCloths(const model::Scene& scene, std::uint32_t epoch,
                                               std::uint32_t codec, double seconds);

// Summary of a scene for a list. The caller adds the participants and whether the scene runs.
v1::SceneSummary toSummary(const model::Scene& scene);

// Number of chunks of a content. Each has limits::kMaxChunkBytes, the last may be shorter. Empty content has
// one empty chunk.
std::size_t chunkCount(std::size_t contentBytes);
// One chunk of a content that is the concatenation of `parts`. The content has at most
// limits::kMaxContentBytes.
v1::Chunk toChunk(std::uint64_t contentId, v1::ContentKind kind, std::span<const std::string_view> parts,
                  std::size_t index);

}  // namespace clothstream::messages
