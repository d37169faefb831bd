// SPDX-License-Identifier: MIT
#include "server/delivery/description_chunks.h"

#include <array>
#include <string_view>

#include "clothstream/v1/session.pb.h"
#include "server/messages/description.h"

namespace clothstream::delivery {

std::size_t DescriptionChunks::count() const {
  return messages::chunkCount(geometry_->size() + rest_.size());
}

SharedBytes DescriptionChunks::chunk(std::size_t index) const {
  const std::array<std::string_view, 2> parts{*geometry_, rest_};
  v1::ServerMessage message;
  *message.mutable_chunk() = messages::toChunk(contentId_, v1::CONTENT_KIND_STREAM_DESCRIPTION, parts, index);
  return serialise(message);
}

}  // namespace clothstream::delivery
