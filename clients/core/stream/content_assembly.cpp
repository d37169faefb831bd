// SPDX-License-Identifier: MIT
// Checks each chunk against the size and count that its content announced.
#include "clients/core/stream/content_assembly.h"

#include <algorithm>
#include <numeric>

namespace clothstream::client {
namespace {

tl::unexpected<std::string> wrong(const Chunk& chunk, const std::string& what) {
  return tl::unexpected("piece " + std::to_string(chunk.index) + " of content " +
                        std::to_string(chunk.contentId) + ": " + what);
}

}  // namespace

std::uint64_t ContentAssembly::announcedBytes() const {
  return std::accumulate(unfinished_.begin(), unfinished_.end(), std::uint64_t{0},
                         [](std::uint64_t sum, const Content& content) { return sum + content.totalBytes; });
}

tl::expected<ContentAssembly::Content*, std::string> ContentAssembly::contentOf(const Chunk& chunk,
                                                                                std::uint64_t maxBytes) {
  const auto known = std::find_if(unfinished_.begin(), unfinished_.end(),
                                  [&](const Content& content) { return content.id == chunk.contentId; });
  if (known != unfinished_.end()) {
    if (chunk.index != known->nextIndex)
      return wrong(chunk, "expected piece " + std::to_string(known->nextIndex));
    if (chunk.count != known->count || chunk.totalBytes != known->totalBytes)
      return wrong(chunk, "announces another size than the earlier pieces");
    return &*known;
  }
  if (chunk.index != 0) return wrong(chunk, "the first piece is missing");
  if (chunk.count == 0) return wrong(chunk, "a content has at least one piece");
  if (chunk.totalBytes > maxBytes - std::min(maxBytes, announcedBytes()))
    return wrong(chunk,
                 std::to_string(chunk.totalBytes) + " bytes announced; " + std::to_string(maxBytes) +
                     " are allowed for all unfinished contents together (cs_limits.max_content_bytes)");
  if (unfinished_.size() == kMaxUnfinished)
    return wrong(chunk, "more than " + std::to_string(kMaxUnfinished) + " contents at the same time");
  Content& content = unfinished_.emplace_back();
  content.id = chunk.contentId;
  content.count = chunk.count;
  content.totalBytes = chunk.totalBytes;
  return &content;
}

tl::expected<std::optional<std::string>, std::string> ContentAssembly::add(const Chunk& chunk,
                                                                           std::uint64_t maxBytes) {
  if (chunk.kind != field::ContentKind::kStreamDescription) return std::nullopt;
  if (chunk.data.size() > kMaxChunkBytes)
    return wrong(chunk, std::to_string(chunk.data.size()) + " bytes; at most " +
                            std::to_string(kMaxChunkBytes) + " are allowed");
  const auto found = contentOf(chunk, maxBytes);
  if (!found) return tl::unexpected(found.error());
  Content& content = **found;
  if (chunk.data.size() > content.totalBytes - content.data.size())
    return wrong(chunk, "more bytes than the " + std::to_string(content.totalBytes) + " announced");
  content.data.append(chunk.data.data(), chunk.data.size());
  ++content.nextIndex;
  if (content.nextIndex < content.count) return std::nullopt;
  if (content.data.size() != content.totalBytes)
    return wrong(chunk, "the last piece ends after " + std::to_string(content.data.size()) + " bytes of " +
                            std::to_string(content.totalBytes));
  std::optional<std::string> data(std::move(content.data));
  unfinished_.erase(unfinished_.begin() + (&content - unfinished_.data()));
  return data;
}

}  // namespace clothstream::client
