// SPDX-License-Identifier: MIT
// Puts large contents together from the chunks they travel in.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/core/wire/server_message.h"

namespace clothstream::client {

enum class ContentKind : std::uint32_t { streamDescription = 1 };

class ContentAssembly {
 public:
  static constexpr std::size_t kMaxChunkBytes = 256 * 1024;
  // Also of all unfinished contents together.
  static constexpr std::uint64_t kMaxContentBytes = 256ull * 1024 * 1024;
  static constexpr std::size_t kMaxUnfinished = 4;

  // Pieces of one content come in order; contents may interleave. Gives the bytes of a stream description
  // when its last piece is in; nothing for kinds that this client does not know, which take no memory. The
  // error says what the server did wrong. Memory grows with what arrives, not with what is announced.
  [[nodiscard]] tl::expected<std::optional<std::string>, std::string> add(const Chunk& chunk);

 private:
  struct Content {
    std::uint64_t id = 0;
    std::uint32_t count = 0, nextIndex = 0;
    std::uint64_t totalBytes = 0;
    std::string data;
  };

  tl::expected<Content*, std::string> contentOf(const Chunk& chunk);
  std::uint64_t announcedBytes() const;

  std::vector<Content> unfinished_;
};

}  // namespace clothstream::client
