// SPDX-License-Identifier: MIT
// Everything that a decoder needs before its first frame, in pieces.
#include "server/stream/description.h"

#include <array>
#include <string_view>

#include "server/messages/description.h"

namespace clothstream::stream {

std::size_t Description::chunks() const {
  return messages::chunkCount(geometry_->size() + rest_.size());
}

SharedBytes Description::chunk(std::size_t index) const {
  const std::array<std::string_view, 2> parts{*geometry_, rest_};
  v1::ServerMessage message;
  *message.mutable_chunk() = messages::toChunk(contentId_, v1::CONTENT_KIND_STREAM_DESCRIPTION, parts, index);
  return serialise(message);
}

}  // namespace clothstream::stream
