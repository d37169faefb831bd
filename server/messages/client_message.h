// SPDX-License-Identifier: MIT
// Messages of clients: parses and checks them, and converts them to the model.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/model/input.h"
#include "server/model/stability.h"

namespace clothstream::messages {

// Newest protocol version that this server speaks.
inline constexpr std::uint32_t kProtocolVersion = 1;

// Parses an envelope of at most limits::kMaxClientMessageBytes that has a body. Errors: MALFORMED_MESSAGE if
// the bytes are not a ClientMessage, RESOURCE_EXHAUSTED if they are too many.
[[nodiscard]] Result<v1::ClientMessage> parseClientMessage(std::span<const std::byte> bytes);

// Join request after the negotiation of version and codec.
struct Joining {
  std::uint32_t protocolVersion = 0;
  std::uint32_t codec = 0;
  std::string scene;  // empty: the server's default
  std::string clientName, displayName;
  v1::Role role = v1::ROLE_UNSPECIFIED;
  std::uint8_t quality = 0;  // finest quality that the client wants; 0 is the finest of all
};

// `codecs` are the codecs of the server. Selects the first codec of the client that is among them.
[[nodiscard]] Result<Joining> toJoining(const v1::Hello& message, std::span<const std::uint32_t> codecs);

// At most limits::kMaxParticipantColliders colliders, with the bones of hands last, and
// limits::kMaxParticipantGrabs grabs. Ids must be unique. Attachments, and colliders with
// joints, must exist in the scene.
[[nodiscard]] Result<model::ParticipantPoses> toPoses(const v1::ColliderPoses& message,
                                                      const model::Scene& scene);

// Change that stops the collider of a body that a participant takes; empty if it keeps its motion, and if the
// participant gives its body back.
[[nodiscard]] Result<v1::ParameterChange> toWornBody(const v1::WearBody& message, const model::Scene& scene);

// Refuses a change that cannot be applied to this scene as a whole: if a name does not exist, a value is out
// of range, or the scene would be unstable with its substeps. `bound` is of this scene before any change.
[[nodiscard]] Result<model::ParameterChange> toParameterChange(const v1::ParameterChange& message,
                                                               const model::Scene& scene,
                                                               const model::StabilityBound& bound);

}  // namespace clothstream::messages
