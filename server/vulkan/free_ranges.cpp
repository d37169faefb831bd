// SPDX-License-Identifier: MIT
// Free ranges of a block of memory.
#include "server/vulkan/free_ranges.h"

#include <cassert>
#include <iterator>

namespace clothstream::vulkan {

FreeRanges::FreeRanges(std::uint64_t bytes) : bytes_(bytes) {
  assert(bytes > 0);
  add(0, bytes);
}

void FreeRanges::add(std::uint64_t begin, std::uint64_t end) {
  if (begin == end) return;
  byOffset_.emplace(begin, end);
  bySize_.emplace(end - begin, begin);
}

void FreeRanges::remove(std::uint64_t begin, std::uint64_t end) {
  byOffset_.erase(begin);
  bySize_.erase({end - begin, begin});
}

std::optional<std::uint64_t> FreeRanges::take(std::uint64_t bytes, std::uint64_t alignment) {
  assert(bytes > 0 && alignment > 0);
  for (auto range = bySize_.lower_bound({bytes, 0}); range != bySize_.end(); ++range) {
    const auto [size, begin] = *range;
    const std::uint64_t skipped = (alignment - begin % alignment) % alignment;
    if (skipped > size - bytes) continue;
    const std::uint64_t offset = begin + skipped, end = begin + size;
    remove(begin, end);
    add(begin, offset);
    add(offset + bytes, end);
    return offset;
  }
  return std::nullopt;
}

void FreeRanges::giveBack(std::uint64_t offset, std::uint64_t bytes) {
  std::uint64_t begin = offset, end = offset + bytes;
  assert(bytes > 0 && end <= bytes_);
  const auto next = byOffset_.lower_bound(offset);
  assert(next == byOffset_.end() || next->first >= end);
  assert(next == byOffset_.begin() || std::prev(next)->second <= begin);
  std::optional<std::pair<std::uint64_t, std::uint64_t>> before, after;
  if (next != byOffset_.begin() && std::prev(next)->second == begin) before = *std::prev(next);
  if (next != byOffset_.end() && next->first == end) after = *next;
  if (before) {
    remove(before->first, before->second);
    begin = before->first;
  }
  if (after) {
    remove(after->first, after->second);
    end = after->second;
  }
  add(begin, end);
}

bool FreeRanges::allFree() const {
  return !bySize_.empty() && bySize_.rbegin()->first == bytes_;
}

}  // namespace clothstream::vulkan
