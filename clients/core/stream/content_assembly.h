// SPDX-License-Identifier: MIT
// Assembles large contents from chunks.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/core/wire/server_message.h"

namespace clothstream::client {

class ContentAssembly {
 public:
  static constexpr std::size_t kMaxChunkBytes = 256 * 1024;
  static constexpr std::size_t kMaxUnfinished = 4;

  // Adds a chunk. Chunks of one content must arrive in order; contents may interleave. Returns the bytes of a
  // stream description after its last chunk, else nullopt. Unknown kinds of content are ignored. The error
  // says what the server did wrong. Memory grows with the data that arrived, not with the announced size.
  // `maxBytes` limits all unfinished contents together.
  [[nodiscard]] tl::expected<std::optional<std::string>, std::string> add(const Chunk& chunk,
                                                                          std::uint64_t maxBytes);

 private:
  struct Content {
    std::uint64_t id = 0;
    std::uint32_t count = 0, nextIndex = 0;
    std::uint64_t totalBytes = 0;
    std::string data;
  };

  tl::expected<Content*, std::string> contentOf(const Chunk& chunk, std::uint64_t maxBytes);
  std::uint64_t announcedBytes() const;

  std::vector<Content> unfinished_;
};

}  // namespace clothstream::client
