// SPDX-License-Identifier: MIT
// Free ranges of a block of memory.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>

namespace clothstream::vulkan {

// Knows offsets and no memory. Takes and gives back in a time that grows with the logarithm of the number of
// free ranges. Not thread-safe.
class FreeRanges {
 public:
  // `bytes`: size of the block, more than 0. All of it is free at first.
  explicit FreeRanges(std::uint64_t bytes);

  // Takes a range of `bytes`, more than 0, whose offset is a multiple of `alignment`, more than 0. Returns
  // the offset, or nothing if there is no such range. Prefers the smallest free range that has room, and of
  // equal ones the first.
  std::optional<std::uint64_t> take(std::uint64_t bytes, std::uint64_t alignment);
  // Frees a range that was taken. It becomes one with the free ranges next to it.
  void giveBack(std::uint64_t offset, std::uint64_t bytes);

  std::uint64_t bytes() const { return bytes_; }
  bool allFree() const;

 private:
  void add(std::uint64_t begin, std::uint64_t end);
  void remove(std::uint64_t begin, std::uint64_t end);

  std::uint64_t bytes_;
  // The free ranges, which never touch one another: by offset, with their ends, and by size, with their
  // offsets. Only add() and remove() change them.
  std::map<std::uint64_t, std::uint64_t> byOffset_;
  std::set<std::pair<std::uint64_t, std::uint64_t>> bySize_;
};

}  // namespace clothstream::vulkan
