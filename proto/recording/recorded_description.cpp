// SPDX-License-Identifier: MIT
#include "proto/recording/recorded_description.h"

namespace clothstream::recording {

static_assert(v1::Frame::kPacketFieldNumber == kFramePacket);

tl::expected<v1::StreamDescription, std::string> readDescription(RecordingReader& reader) {
  const auto bytes = reader.description();
  if (!bytes) return tl::unexpected(bytes.error());
  v1::StreamDescription description;
  if (!description.ParseFromString(*bytes))
    return tl::unexpected(std::string("the description of its stream is invalid"));
  return description;
}

}  // namespace clothstream::recording
