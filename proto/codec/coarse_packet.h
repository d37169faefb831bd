// SPDX-License-Identifier: MIT
// A sixteenth of the vertices, for who is far or weak: packets without what the finest levels take.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace clothstream::codec {

// What a decoder takes of each packet. Decoders of Detail::coarse read whole packets as well as coarse ones.
enum class Detail : std::uint8_t { full, coarse };

// Writes what Detail::coarse needs of a packet to `out` (at least as large; they may be the same memory) and
// returns the number of bytes written; 0 where it is no packet.
std::size_t makeCoarsePacket(std::span<const std::byte> packet, std::span<std::byte> out);

}  // namespace clothstream::codec
