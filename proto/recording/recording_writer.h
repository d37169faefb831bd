// SPDX-License-Identifier: MIT
// Writes messages of the protocol to the channels of a recording.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/mcap_writer.h"
#include "proto/recording/topics.h"

namespace clothstream::recording {

// Not thread-safe. Errors come from the sink. Times are nanoseconds since 1970 from a clock that never goes
// back.
class RecordingWriter {
 public:
  // `writer` is the program's name and version.
  [[nodiscard]] static tl::expected<RecordingWriter, std::string> begin(Sink sink, std::string_view writer,
                                                                        const Metadata& metadata);

  // Writes a serialised message of the topic's type.
  [[nodiscard]] Written write(Topic topic, std::uint64_t time, std::string_view message);
  // Writes what a stream sends to everyone in a scene: frames with their reports, changes, events and
  // notices. Ignores all other messages.
  [[nodiscard]] Written write(std::uint64_t time, const v1::ServerMessage& message);

  [[nodiscard]] Written closeChunk() { return mcap_.closeChunk(); }
  [[nodiscard]] Written finish() { return mcap_.finish(); }
  // Finishes with other metadata, which replaces that of begin().
  [[nodiscard]] Written finish(const Metadata& metadata) {
    return mcap_.closeChunk()
        .and_then([&] { return mcap_.addMetadata(kMetadataName, metadata); })
        .and_then([&] { return mcap_.finish(); });
  }
  std::uint64_t bytes() const { return mcap_.bytes(); }

 private:
  explicit RecordingWriter(Sink sink) : mcap_(std::move(sink)) {}

  McapWriter mcap_;
  std::array<std::uint16_t, kTopicNames.size()> channels_{};
  std::string bytes_;  // serialised message; reused
};

}  // namespace clothstream::recording
