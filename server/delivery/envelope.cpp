// SPDX-License-Identifier: MIT
#include "server/delivery/envelope.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <utility>

#include <google/protobuf/io/coded_stream.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::delivery {
namespace {

using google::protobuf::io::CodedOutputStream;

// First byte of a length-delimited field: number and wire type 2, for field numbers below 16.
constexpr std::uint8_t lengthDelimited(int field) {
  return static_cast<std::uint8_t>(field << 3 | 2);
}
constexpr std::uint8_t kFrameTag = lengthDelimited(v1::ServerMessage::kFrameFieldNumber);
constexpr std::uint8_t kPacketTag = lengthDelimited(v1::Frame::kPacketFieldNumber);
static_assert(v1::ServerMessage::kFrameFieldNumber < 16);
static_assert(v1::Frame::kPacketFieldNumber == 1, "fields are serialised in the order of their numbers");

std::size_t fieldBytes(std::size_t content) {
  return 1 + CodedOutputStream::VarintSize32(static_cast<std::uint32_t>(content)) + content;
}

}  // namespace

SharedBytes serialise(const v1::ServerMessage& message) {
  auto bytes = std::make_shared<std::vector<std::byte>>(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(bytes->data()));
  return bytes;
}

SharedBytes serialiseFrame(const v1::Frame& frame, std::span<const std::byte> packet) {
  assert(frame.packet().empty());
  const std::size_t rest = frame.ByteSizeLong();
  const std::size_t content = (packet.empty() ? 0 : fieldBytes(packet.size())) + rest;
  std::array<std::uint8_t, 16> start{};
  std::uint8_t* end = start.data();
  *end++ = kFrameTag;
  end = CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(content), end);
  if (!packet.empty()) {
    *end++ = kPacketTag;
    end = CodedOutputStream::WriteVarint32ToArray(static_cast<std::uint32_t>(packet.size()), end);
  }
  auto bytes = std::make_shared<std::vector<std::byte>>();
  bytes->reserve(fieldBytes(content));
  const auto* const first = reinterpret_cast<const std::byte*>(start.data());
  bytes->insert(bytes->end(), first, first + (end - start.data()));
  bytes->insert(bytes->end(), packet.begin(), packet.end());
  bytes->resize(bytes->size() + rest);
  frame.SerializeWithCachedSizesToArray(
      reinterpret_cast<std::uint8_t*>(bytes->data() + bytes->size() - rest));
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

SharedBytes error(v1::ErrorCode code, std::string text, bool fatal, std::uint64_t requestId,
                  std::string server) {
  v1::ServerMessage message;
  message.set_request_id(requestId);
  message.mutable_error()->set_code(code);
  message.mutable_error()->set_text(std::move(text));
  message.mutable_error()->set_fatal(fatal);
  message.mutable_error()->set_server(std::move(server));
  return serialise(message);
}

SharedBytes moving(std::string server) {
  v1::ServerMessage message;
  message.mutable_moving()->set_server(std::move(server));
  return serialise(message);
}

SharedBytes tooSlow() {
  return error(v1::ERROR_CODE_CUT_OFF,
               "the client is too slow: read the answers of the server, or send fewer requests", true);
}

}  // namespace clothstream::delivery
