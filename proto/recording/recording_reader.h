// SPDX-License-Identifier: MIT
// Reader of recordings: message by message, starting at any time.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include <tl/expected.hpp>

#include "proto/codec/stream_layout.h"
#include "proto/recording/mcap_reader.h"
#include "proto/recording/topics.h"

namespace clothstream::recording {

struct RecordedMessage {
  Topic topic{};
  std::uint64_t time = 0;  // ns since 1970
  std::string_view bytes;  // valid until the next call
};

// Limits of a reader, so that a small file cannot cost much memory or time. A file that exceeds them is
// refused before memory is allocated.
struct ReadLimits {
  std::uint32_t vertices = codec::kDefaultMaxVertices;  // of all cloths; twice as many triangles

  // Limits of chunks: a description of this size fits into one, with triangles and texture coordinates.
  McapLimits mcap() const {
    constexpr std::uint64_t kLeastBytes = std::uint64_t{32} << 20, kBytesPerVertex = 96;
    return {.chunkBytes = kLeastBytes + kBytesPerVertex * vertices};
  }
  // Says what exceeds the limit; empty if nothing does.
  std::string problemOf(std::uint64_t vertexCount, std::uint64_t triangleCount) const;
};

// Policy for truncated recordings: refuse them, or read them up to their end.
enum class CutFiles : std::uint8_t { refused, read };

// Safe on any bytes. Errors name the path and, if possible, what to do.
class RecordingReader {
 public:
  [[nodiscard]] static tl::expected<RecordingReader, std::string> open(const std::string& path,
                                                                       CutFiles cutFiles = CutFiles::refused,
                                                                       const ReadLimits& limits = {});
  [[nodiscard]] static tl::expected<RecordingReader, std::string> open(std::unique_ptr<ByteSource> source,
                                                                       std::string name, CutFiles cutFiles,
                                                                       const ReadLimits& limits = {});

  const McapReader& mcap() const { return mcap_; }
  const ReadLimits& limits() const { return limits_; }
  // Name of the file for error messages.
  const std::string& name() const { return name_; }
  [[nodiscard]] tl::expected<void, std::string> check();
  // Metadata: the machine and the program that made the recording.
  const Metadata& metadata() const { return metadata_; }
  // Value of a metadata entry; "unknown" if it is missing.
  const std::string& metadata(const std::string& name) const;
  std::optional<Topic> topicOf(std::uint16_t channel) const;
  // Times of the first and the last message, ns.
  std::uint64_t start() const;
  std::uint64_t end() const;

  // Serialised StreamDescription at the start of the recording. Rewinds. readDescription parses it.
  [[nodiscard]] tl::expected<std::string, std::string> description();

  // Next message; nothing at the end. Messages of unknown channels are skipped.
  [[nodiscard]] tl::expected<std::optional<RecordedMessage>, std::string> next();
  // Makes the newest key frame at or before `time` the next message; without one, the first message.
  [[nodiscard]] tl::expected<void, std::string> seek(std::uint64_t time);
  void rewind();
  // A message: its chunk, and its index among all messages of the chunk.
  struct Place {
    std::size_t chunk = 0, message = 0;
    friend auto operator<=>(const Place&, const Place&) = default;
  };
  // Place of the next message, to which go() returns.
  Place place() const { return {chunk_, message_}; }
  void go(const Place& place) { std::tie(chunk_, message_) = std::tuple(place.chunk, place.message); }
  // Messages of a topic in a chunk with an index from `first` to `end` - 1, valid until the next call. Does
  // not move the reader.
  [[nodiscard]] tl::expected<std::vector<RecordedMessage>, std::string> messages(
      std::size_t chunk, Topic topic, std::size_t first = 0,
      std::size_t end = std::numeric_limits<std::size_t>::max());
  // Recovers after an error of next(): the next message is the first of the following chunk. Returns the
  // chunk that is skipped.
  ChunkPlace passChunk();

 private:
  RecordingReader(McapReader mcap, std::string name, const ReadLimits& limits)
      : mcap_(std::move(mcap)), limits_(limits), name_(std::move(name)) {}
  [[nodiscard]] tl::unexpected<std::string> broken(std::string_view what) const;
  [[nodiscard]] tl::expected<void, std::string> load(std::size_t chunk);

  McapReader mcap_;
  ReadLimits limits_;
  std::string name_;
  Metadata metadata_;
  std::map<std::uint16_t, Topic> topics_;

  std::size_t chunk_ = 0, message_ = 0;  // next chunk and message
  std::optional<std::size_t> loaded_;    // chunk in messages_
  std::span<const Message> messages_;
};

// Field numbers of Frame.packet and Frame.reconstruction_hash.
inline constexpr std::uint32_t kFramePacket = 1, kFrameReconstructionHash = 4;

// Packet and hash of a serialised Frame.
struct FrameContent {
  std::span<const std::byte> packet;  // inside the bytes of the Frame
  std::uint64_t reconstructionHash = 0;
};
// nullopt if the bytes are not a Frame.
std::optional<FrameContent> frameContentOf(std::string_view frame);
// True if a serialised Frame can be decoded without earlier frames.
bool isKeyFrame(std::string_view frame);

}  // namespace clothstream::recording
