// SPDX-License-Identifier: MIT
// Feeds recorded messages to a client, as a server would send them.
#include "clients/cli/played_recording.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::cli {
namespace {

constexpr std::size_t kChunkBytes = 256 * 1024;
constexpr std::uint64_t kContentId = 1;

std::uint32_t give(cs_client* client, const v1::ServerMessage& message, std::uint64_t timeNs) {
  const std::string bytes = message.SerializeAsString();
  return cs_receive(client, reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), timeNs / 1000);
}

void describe(cs_client* client, const v1::StreamDescription& description, std::uint64_t timeNs) {
  v1::ServerMessage message;
  v1::Welcome& welcome = *message.mutable_welcome();
  welcome.set_protocol_version(CS_PROTOCOL_VERSION);
  welcome.set_codec(description.codec());
  welcome.set_scene(description.scene());
  welcome.set_participant_id(1);
  welcome.set_description_content_id(kContentId);
  give(client, message, timeNs);
  const std::string content = description.SerializeAsString();
  const std::size_t count = std::max<std::size_t>(1, (content.size() + kChunkBytes - 1) / kChunkBytes);
  for (std::size_t i = 0; i < count; ++i) {
    v1::Chunk& chunk = *message.mutable_chunk();
    chunk.set_content_id(kContentId);
    chunk.set_kind(v1::CONTENT_KIND_STREAM_DESCRIPTION);
    chunk.set_index(static_cast<std::uint32_t>(i));
    chunk.set_count(static_cast<std::uint32_t>(count));
    chunk.set_total_bytes(content.size());
    chunk.set_data(content.substr(i * kChunkBytes, kChunkBytes));
    give(client, message, timeNs);
  }
}

}  // namespace

tl::expected<PlayedRecording, std::string> PlayedRecording::open(recording::RecordingReader reader) {
  const auto description = reader.description();
  if (!description) return tl::unexpected(description.error());
  PlayedRecording played(std::move(reader), {cs_create("", "recording"), &cs_destroy});
  describe(played.client_.get(), *description, played.reader_.start());
  if (cs_get_state(played.client()) != CS_STATE_JOINED)
    return tl::unexpected(
        fmt::format("the recorded stream cannot be played: {}", cs_error_text(played.client())));
  return played;
}

tl::expected<bool, std::string> PlayedRecording::next() {
  for (;;) {
    const auto message = reader_.next();
    if (!message) return tl::unexpected(message.error());
    if (!*message) return false;
    if ((*message)->topic != recording::Topic::frames) continue;
    time_ = (*message)->time;
    v1::ServerMessage envelope;
    const std::string_view bytes = (*message)->bytes;
    if (!envelope.mutable_frame()->ParseFromArray(bytes.data(), static_cast<int>(bytes.size())))
      return tl::unexpected(std::string("a frame of the recording cannot be read"));
    const std::uint32_t events = give(client_.get(), envelope, time_);
    if (cs_get_state(client()) == CS_STATE_FAILED)
      return tl::unexpected(std::string(cs_error_text(client())));
    // Discards requests and acknowledgements of the client.
    for (std::size_t size = 0; cs_next_outgoing(client_.get(), &size) != nullptr;) {
    }
    if ((events & CS_EVENT_FRAME) != 0) return true;
  }
}

}  // namespace clothstream::cli
