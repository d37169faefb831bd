// SPDX-License-Identifier: MIT
// Reads MCAP, whole or cut off. Safe on any bytes.
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
};

struct ReadSchema {
  std::string name, encoding, data;
};

// Where a chunk is, and the times of its messages, ns.
struct ChunkPlace {
  std::uint64_t start = 0, end = 0;
  std::uint64_t offset = 0, length = 0;  // of the record in the file
  // Of its messages, as the index says, or in a file without one the message indexes behind the chunk;
  // nothing where there are none, or the file ends in them.
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
  // Finds all chunks: by the index at the end where it is there and whole, and otherwise by going from record
  // to record.
  [[nodiscard]] static tl::expected<McapReader, std::string> open(std::unique_ptr<ByteSource> source);
  ~McapReader();
  McapReader(McapReader&&) noexcept;
  McapReader& operator=(McapReader&&) = delete;

  // Whether there is an index. A recording without one was cut off, or damaged at its end.
  bool indexed() const;
  const std::string& library() const;
  const std::map<std::uint16_t, Channel>& channels() const;
  const std::map<std::uint16_t, ReadSchema>& schemas() const;
  // In the order of their times.
  std::span<const ChunkPlace> chunks() const;
  // As the file says.
  const std::optional<Statistics>& statistics() const;
  const Facts* facts(const std::string& name) const;
  std::uint64_t bytes() const;

  // The last chunk that begins at this time or before, or else the first.
  std::size_t chunkAt(std::uint64_t time) const;
  // The messages of a chunk, in their order; until the next call. The error, too: its checksum does not
  // match.
  [[nodiscard]] tl::expected<std::span<const Message>, std::string> read(std::size_t chunk);

  // Where the chunks, their indexes, and what stands before them end: what follows is index, or nothing that
  // can be read.
  std::uint64_t dataEnd() const;
  // Reads every byte once: chunks, message indexes, the checksum of all data, and whether the statistics are
  // true. The error is the first that was found.
  [[nodiscard]] tl::expected<void, std::string> check();

 private:
  struct State;
  explicit McapReader(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::recording
