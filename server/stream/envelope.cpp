// SPDX-License-Identifier: MIT
// Serialises ServerMessages.
#include "server/stream/envelope.h"

#include <utility>

namespace clothstream::stream {

SharedBytes serialise(const v1::ServerMessage& message) {
  auto bytes = std::make_shared<std::vector<std::byte>>(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(bytes->data()));
  return bytes;
}

SharedBytes notice(v1::NoticeKind kind, std::string text, std::uint64_t tick, std::uint64_t participant) {
  v1::ServerMessage message;
  message.mutable_notice()->set_kind(kind);
  message.mutable_notice()->set_text(std::move(text));
  message.mutable_notice()->set_tick(tick);
  message.mutable_notice()->set_participant_id(participant);
  return serialise(message);
}

SharedBytes parametersChanged(v1::ParameterChange change, std::uint64_t tick, std::uint64_t participant) {
  v1::ServerMessage message;
  *message.mutable_parameter_changed()->mutable_change() = std::move(change);
  message.mutable_parameter_changed()->set_participant_id(participant);
  message.mutable_parameter_changed()->set_tick(tick);
  return serialise(message);
}

SharedBytes error(v1::ErrorCode code, std::string text, bool fatal, std::uint64_t requestId) {
  v1::ServerMessage message;
  message.set_request_id(requestId);
  message.mutable_error()->set_code(code);
  message.mutable_error()->set_text(std::move(text));
  message.mutable_error()->set_fatal(fatal);
  return serialise(message);
}

SharedBytes tooSlow() {
  return error(v1::ERROR_CODE_CUT_OFF,
               "too much waits to be read: read what the server sends, or ask and change less", true);
}

}  // namespace clothstream::stream
