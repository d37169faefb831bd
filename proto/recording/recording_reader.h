// SPDX-License-Identifier: MIT
// A recording message by message, from any time on.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "clothstream/v1/session.pb.h"
#include "proto/recording/mcap_reader.h"
#include "proto/recording/topics.h"

namespace clothstream::recording {

struct RecordedMessage {
  Topic topic{};
  std::uint64_t time = 0;  // ns since 1970
  std::string_view bytes;  // until the next call
};

// Whether recordings that were cut off can be read, as far as they go.
enum class CutFiles : std::uint8_t { refused, read };

// Safe on any bytes. Errors name the path, and what to do where something can be done.
class RecordingReader {
 public:
  [[nodiscard]] static tl::expected<RecordingReader, std::string> open(const std::string& path,
                                                                       CutFiles cutFiles = CutFiles::refused);
  [[nodiscard]] static tl::expected<RecordingReader, std::string> open(std::unique_ptr<ByteSource> source,
                                                                       std::string name, CutFiles cutFiles);

  const McapReader& mcap() const { return mcap_; }
  [[nodiscard]] tl::expected<void, std::string> check();
  // Of what the recording was made on and with.
  const Facts& facts() const { return facts_; }
  // The value; "unknown" where there is none.
  const std::string& fact(const std::string& name) const;
  std::optional<Topic> topicOf(std::uint16_t channel) const;
  // Of the first and the last message, ns.
  std::uint64_t start() const;
  std::uint64_t end() const;

  // Of the recorded stream, as it was when the recording began.
  [[nodiscard]] tl::expected<v1::StreamDescription, std::string> description();

  // The next message, nothing at the end. Messages of unknown channels are passed over.
  [[nodiscard]] tl::expected<std::optional<RecordedMessage>, std::string> next();
  // The next message is then the newest key frame at this time or before, or else the first message.
  [[nodiscard]] tl::expected<void, std::string> seek(std::uint64_t time);
  void rewind();
  // All of this topic in a chunk; until the next call of anything. What comes next stays what it was.
  [[nodiscard]] tl::expected<std::vector<RecordedMessage>, std::string> messages(std::size_t chunk,
                                                                                 Topic topic);
  // After an error of next(): the next message is then the first of the chunk that follows. What is left out.
  ChunkPlace passChunk();

 private:
  RecordingReader(McapReader mcap, std::string name) : mcap_(std::move(mcap)), name_(std::move(name)) {}
  [[nodiscard]] tl::unexpected<std::string> broken(std::string_view what) const;
  [[nodiscard]] tl::expected<void, std::string> load(std::size_t chunk);

  McapReader mcap_;
  std::string name_;
  Facts facts_;
  std::map<std::uint16_t, Topic> topics_;

  std::size_t chunk_ = 0, message_ = 0;  // the next
  std::optional<std::size_t> loaded_;    // chunk
  std::span<const Message> messages_;    // of it
};

// Whether a serialised Frame can be decoded without those before it.
bool isKeyFrame(std::string_view frame);

}  // namespace clothstream::recording
