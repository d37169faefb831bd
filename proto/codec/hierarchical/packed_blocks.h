// SPDX-License-Identifier: MIT
// Numbers in blocks that each say how they are written: what codec 3 has in place of rANS. A device can write
// many of them at once, and the kernels do, to the bit (shaders/encode/hierarchical/pack.glsl).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/codec/hierarchical/bits.h"

namespace clothstream::codec::hierarchical {

inline constexpr std::uint32_t kBlockVertices = 32;
// A group stands by itself, in whole bytes.
inline constexpr std::uint32_t kGroupBlocks = 64, kGroupVertices = kGroupBlocks * kBlockVertices;

// How a block writes the numbers of a component. 0: none, all are 0. 1: of each run of so many, a bit says
// whether all are 0; where not, they follow as in mode 2. From 2 on: all, with mode - 2 of their lowest bits
// as they are, what is above in so many ones.
using Mode = std::uint32_t;
inline constexpr std::uint32_t kRunVertices = 4;
inline constexpr Mode kNoNumbers = 0, kRuns = 1, kFirstPlain = 2, kModes = 32;

// Among the numbers along the normal: the vertex stays.
inline constexpr std::uint32_t kStayNumber = ~0u;

// The numbers of a group, by component; null beyond the last one.
struct GroupNumbers {
  std::array<const std::uint32_t*, 3> components{};
  std::size_t count = 0;  // of vertices, kGroupVertices at most
  bool hasStays = false;  // in the first component
};

// Bits that a number below 2^31 takes at most, and what else a block says of a component.
inline constexpr std::size_t kMostNumberBits = 76, kMostModeBits = 26;
// Bytes that the groups of so many vertices take at most.
constexpr std::size_t groupsBound(std::size_t components, std::size_t vertices) {
  const std::size_t blocks = vertices / kBlockVertices + 1, groups = vertices / kGroupVertices + 1;
  return components * (blocks * kMostModeBits + vertices * kMostNumberBits) / 8 + 2 * groups;
}

// `out` stands at a whole byte, before and after.
void writeGroup(const GroupNumbers& numbers, BitWriter& out);

// Where readGroup() writes to; as in GroupNumbers, and null where there are no stays.
struct GroupResiduals {
  std::array<std::int32_t*, 3> components{};
  std::uint8_t* stays = nullptr;
  std::size_t count = 0;
};

// False where it is no group; `in` may end anywhere.
[[nodiscard]] bool readGroup(BitReader& in, const GroupResiduals& residuals);

}  // namespace clothstream::codec::hierarchical
