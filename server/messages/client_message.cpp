// SPDX-License-Identifier: MIT
// Envelopes, greetings and collider poses from clients.
#include "server/messages/client_message.h"

#include <algorithm>
#include <unordered_set>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "server/messages/limits.h"
#include "server/messages/shapes.h"
#include "server/messages/validation.h"
#include "server/messages/vectors.h"

namespace clothstream::messages {
namespace {

tl::unexpected<FieldError> refuse(v1::ErrorCode code, std::string text) {
  return tl::unexpected(FieldError{code, std::move(text)});
}

}  // namespace

Result<v1::ClientMessage> parseClientMessage(std::span<const std::byte> bytes) {
  if (bytes.size() > limits::kMaxClientMessageBytes)
    return refuse(v1::ERROR_CODE_RESOURCE_EXHAUSTED,
                  fmt::format("a message of {} bytes is too large: must have at most {}", bytes.size(),
                              limits::kMaxClientMessageBytes));
  v1::ClientMessage message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
    return refuse(v1::ERROR_CODE_MALFORMED_MESSAGE,
                  fmt::format("{} bytes are no clothstream.v1.ClientMessage", bytes.size()));
  if (message.body_case() == v1::ClientMessage::BODY_NOT_SET)
    return refuse(v1::ERROR_CODE_MALFORMED_MESSAGE,
                  "a clothstream.v1.ClientMessage without a body that this server knows");
  return message;
}

Result<Joining> toJoining(const v1::Hello& message, std::span<const std::uint32_t> codecs) {
  Checks checks;
  const Path hello("hello");
  if (message.protocol_version() == 0)
    checks.fail(hello / "protocolVersion", "0",
                fmt::format("must be 1 or more; this server speaks {}", kProtocolVersion),
                v1::ERROR_CODE_UNSUPPORTED_VERSION);
  const auto codec = std::ranges::find_first_of(message.codecs(), codecs);
  if (codec == message.codecs().end())
    checks.fail(hello / "codecs", "",
                fmt::format("must have one that this server encodes: {}", fmt::join(codecs, ", ")),
                v1::ERROR_CODE_UNSUPPORTED_CODEC);
  if (!message.scene().empty()) checks.name(hello / "scene", message.scene());
  checks.text(hello / "clientName", message.client_name());
  checks.text(hello / "displayName", message.display_name());
  if (checks.failed()) return std::move(checks).result(Joining{});
  return Joining{std::min(message.protocol_version(), kProtocolVersion), *codec, message.scene(),
                 message.client_name(), message.display_name()};
}

Result<std::vector<scene::ParticipantCollider>> toColliders(const v1::ColliderPoses& message) {
  Checks checks;
  const Path poses("colliderPoses");
  checks.count(poses / "colliders", static_cast<std::size_t>(message.colliders_size()), 0,
               limits::kMaxParticipantColliders);
  std::vector<scene::ParticipantCollider> colliders;
  std::unordered_set<std::uint32_t> ids;
  for (int i = 0; i < message.colliders_size() && !checks.failed(); ++i) {
    const v1::ParticipantCollider& from = message.colliders(i);
    const Path path = poses.at("colliders", i);
    if (!ids.insert(from.id()).second)
      checks.fail(path / "id", fmt::format("{}", from.id()), "is another's id already; ids must be unique");
    colliders.push_back({from.id(), toPose(checks, path / "pose", from.pose()), toShape(checks, path, from)});
  }
  return std::move(checks).result(std::move(colliders));
}

}  // namespace clothstream::messages
