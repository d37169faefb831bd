// SPDX-License-Identifier: MIT
// What clients send, checked: bytes to envelopes, envelopes to domain types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/messages/field_error.h"
#include "server/model/input.h"

namespace clothstream::messages {

// The newest protocol version that this server speaks.
inline constexpr std::uint32_t kProtocolVersion = 1;

// One envelope of at most limits::kMaxClientMessageBytes, with a body. MALFORMED_MESSAGE where the bytes are
// no ClientMessage, RESOURCE_EXHAUSTED where they are too many.
[[nodiscard]] Result<v1::ClientMessage> parseClientMessage(std::span<const std::byte> bytes);

// What both ends have agreed on, and who joins.
struct Joining {
  std::uint32_t protocolVersion = 0;
  std::uint32_t codec = 0;
  std::string scene;  // empty: the server's default
  std::string clientName, displayName;
  v1::Role role = v1::ROLE_UNSPECIFIED;
  // The most that it wants of the stream.
  std::uint8_t quality = 0;         // the finest
  std::uint8_t temporalLayers = 1;  // so many
};

// `codecs` are the server's; the client's best that is among them is taken.
[[nodiscard]] Result<Joining> toJoining(const v1::Hello& message, std::span<const std::uint32_t> codecs);

// At most limits::kMaxParticipantColliders, those of hands after the others, and
// limits::kMaxParticipantGrabs, with unique ids; attachments that this scene has, each once.
[[nodiscard]] Result<model::ParticipantPoses> toPoses(const v1::ColliderPoses& message,
                                                      const model::Scene& scene);

// A change that may be applied to this scene as a whole: names exist in it, values are in range, and it stays
// stable with its substeps.
[[nodiscard]] Result<model::ParameterChange> toParameterChange(const v1::ParameterChange& message,
                                                               const model::Scene& scene);

}  // namespace clothstream::messages
