// SPDX-License-Identifier: MIT
// Blocks of numbers that each say how they are written. Codec 3 has them instead of rANS.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/codec/hierarchical/bits.h"

namespace clothstream::codec::hierarchical {

inline constexpr std::uint32_t kBlockVertices = 32;
// A group can be decoded on its own and takes whole bytes.
inline constexpr std::uint32_t kGroupBlocks = 64, kGroupVertices = kGroupBlocks * kBlockVertices;

// The way a block writes the numbers of a component. 0: no numbers, all are 0. 1: for each run of
// kRunVertices vertices a bit that says whether all are 0, and otherwise their numbers as in mode 2. From 2
// on: all numbers, with mode - 2 low bits each and the rest in unary.
using Mode = std::uint32_t;
inline constexpr std::uint32_t kRunVertices = 4;
inline constexpr Mode kNoNumbers = 0, kRuns = 1, kFirstPlain = 2, kModes = 32;

// Number along the normal of a vertex that stays.
inline constexpr std::uint32_t kStayNumber = ~0u;

// Numbers of a group, by component; pointers past the last component are null.
struct GroupNumbers {
  std::array<const std::uint32_t*, 3> components{};
  std::size_t count = 0;  // number of vertices, at most kGroupVertices
  bool hasStays = false;  // true if the first component can hold kStayNumber
};

// Maximum bits of a number below 2^31, and of the mode of a block and component.
inline constexpr std::size_t kMaxNumberBits = 76, kMaxModeBits = 26;
// Maximum bytes of the groups of this many vertices.
constexpr std::size_t groupsBound(std::size_t components, std::size_t vertices) {
  const std::size_t blocks = vertices / kBlockVertices + 1, groups = vertices / kGroupVertices + 1;
  return components * (blocks * kMaxModeBits + vertices * kMaxNumberBits) / 8 + 2 * groups;
}

// `out` is at a whole byte before and after the call.
void writeGroup(const GroupNumbers& numbers, BitWriter& out);

// Destination of readGroup(), as in GroupNumbers; `stays` is null if no vertex can stay.
struct GroupResiduals {
  std::array<std::int32_t*, 3> components{};
  std::uint8_t* stays = nullptr;
  std::size_t count = 0;
};

// False if the bytes are not a group. `in` may end anywhere.
[[nodiscard]] bool readGroup(BitReader& in, const GroupResiduals& residuals);

}  // namespace clothstream::codec::hierarchical
