// SPDX-License-Identifier: MIT
// Messages of the protocol into a recording's channels.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/mcap_writer.h"
#include "proto/recording/topics.h"

namespace clothstream::recording {

// Not thread-safe. Errors are the sink's. Times are nanoseconds since 1970, by a clock that never goes back.
class RecordingWriter {
 public:
  // `writer` is the program's name and version.
  [[nodiscard]] static tl::expected<RecordingWriter, std::string> begin(Sink sink, std::string_view writer,
                                                                        const Facts& facts);

  // A serialised message of the topic's type.
  [[nodiscard]] Written write(Topic topic, std::uint64_t time, std::string_view message);
  // What a stream sends to everybody in a scene: frames with their reports, changes, events, notices.
  // Anything else is passed over.
  [[nodiscard]] Written write(std::uint64_t time, const v1::ServerMessage& message);

  [[nodiscard]] Written closeChunk() { return mcap_.closeChunk(); }
  [[nodiscard]] Written finish() { return mcap_.finish(); }
  std::uint64_t bytes() const { return mcap_.bytes(); }

 private:
  explicit RecordingWriter(Sink sink) : mcap_(std::move(sink)) {}

  McapWriter mcap_;
  std::array<std::uint16_t, kTopicNames.size()> channels_{};
  std::string bytes_;  // of a message, used again
};

}  // namespace clothstream::recording
