// SPDX-License-Identifier: MIT
// Reader of MCAP files, complete or truncated. Safe on any bytes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <tl/expected.hpp>

#include "proto/recording/byte_source.h"
#include "proto/recording/mcap_format.h"

namespace clothstream::recording {

struct Channel {
  std::uint16_t id = 0, schema = 0;
  std::string topic, encoding;
  bool operator==(const Channel&) const = default;
};

struct ReadSchema {
  std::string name, encoding, data;
  bool operator==(const ReadSchema&) const = default;
};

// Bounds of memory and time. A file that is compressed well could otherwise cost thousands of times its size.
struct McapLimits {
  // Largest chunk after decompression, bytes. A chunk can hold one message that is larger than a writer's
  // usual chunk: the description of a large mesh.
  std::uint64_t chunkBytes = std::uint64_t{128} << 20;
  // All chunks together may expand to `expansion` times the size of the file, and to `freeChunks` largest
  // chunks in addition. A server's recording of joints that stand still expands to 600 times its size.
  std::uint64_t expansion = 1024, freeChunks = 4;
};

// Place of a chunk in the file, and the times of its messages in ns.
struct ChunkPlace {
  std::uint64_t start = 0, end = 0;
  std::uint64_t offset = 0, length = 0;  // place of the record in the file
  std::uint64_t size = 0;                // bytes of its messages after decompression
  // Channels of its messages, from the index. In a file without an index they come from the message indexes
  // after the chunk. Empty if there are none or the file ends in them.
  std::optional<std::vector<std::uint16_t>> channels = {};
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint32_t chunks = 0;
  std::uint64_t start = 0, end = 0;  // ns
  std::map<std::uint16_t, std::uint64_t> counts;
};

struct Message {
  std::uint16_t channel = 0;
  std::uint64_t time = 0;  // ns
  std::string_view bytes;
};

// Errors say what is wrong with the bytes, without the file's name.
class McapReader {
 public:
  // Finds all chunks: from the index at the end if it is complete, otherwise record by record. Chunks that
  // expand to more than the limits allow are an error. No chunk is decompressed.
  [[nodiscard]] static tl::expected<McapReader, std::string> open(std::unique_ptr<ByteSource> source,
                                                                  const McapLimits& limits = {});
  ~McapReader();
  McapReader(McapReader&&) noexcept;
  McapReader& operator=(McapReader&&) = delete;

  // True if the file has an index. A recording without one was truncated or is damaged at its end.
  bool indexed() const;
  const std::string& library() const;
  const std::map<std::uint16_t, Channel>& channels() const;
  const std::map<std::uint16_t, ReadSchema>& schemas() const;
  // Ordered by time.
  std::span<const ChunkPlace> chunks() const;
  // Statistics from the file.
  const std::optional<Statistics>& statistics() const;
  const Metadata* metadata(const std::string& name) const;
  std::uint64_t bytes() const;

  // Last chunk that starts at or before `time`; otherwise the first chunk.
  std::size_t chunkAt(std::uint64_t time) const;
  // Messages of a chunk in their order, valid until the next call. A checksum that does not match and a chunk
  // that is larger than the limit are errors.
  [[nodiscard]] tl::expected<std::span<const Message>, std::string> read(std::size_t chunk);

  // End of the chunks, of their indexes and of everything before them. The index follows, or bytes that
  // cannot be read.
  std::uint64_t dataEnd() const;
  // Reads every byte once and checks chunks, message indexes, the checksum of all data and the statistics.
  // The error is the first one found.
  [[nodiscard]] tl::expected<void, std::string> check();

 private:
  struct State;
  explicit McapReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::recording
