// SPDX-License-Identifier: MIT
// Coarse packets have only a sixteenth of the vertices, for clients that show the cloth from far away or have
// little computing power. The data of the two finest levels is removed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace clothstream::codec {

// Part of each packet that a decoder uses. Decoders of Detail::coarse accept whole packets and coarse
// packets.
enum class Detail : std::uint8_t { full, coarse };

// Writes the part of a packet that Detail::coarse needs and returns its size in bytes. `out` is at least as
// large as `packet` and may be the same memory. Returns 0 if the bytes are not a packet.
std::size_t makeCoarsePacket(std::span<const std::byte> packet, std::span<std::byte> out);

}  // namespace clothstream::codec
