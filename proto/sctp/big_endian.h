// SPDX-License-Identifier: MIT
// Numbers in network byte order, and serial numbers that wrap around.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace clothstream::sctp {

// The caller makes sure that the bytes from `at` on are there.
inline std::uint16_t read16(std::span<const std::byte> bytes, std::size_t at) {
  return static_cast<std::uint16_t>(std::to_integer<unsigned>(bytes[at]) << 8 |
                                    std::to_integer<unsigned>(bytes[at + 1]));
}

inline std::uint32_t read32(std::span<const std::byte> bytes, std::size_t at) {
  return std::uint32_t{read16(bytes, at)} << 16 | read16(bytes, at + 2);
}

inline void write16(std::span<std::byte> bytes, std::size_t at, std::size_t value) {
  bytes[at] = static_cast<std::byte>(value >> 8);
  bytes[at + 1] = static_cast<std::byte>(value);
}

inline void write32(std::span<std::byte> bytes, std::size_t at, std::uint32_t value) {
  write16(bytes, at, value >> 16);
  write16(bytes, at + 2, value & 0xffff);
}

// Returns whether the serial number `a` is before `b` (RFC 1982). Numbers that differ by 2^31 or more are in
// the opposite order, so no value stands for "nothing yet".
inline bool isBefore(std::uint32_t a, std::uint32_t b) {
  return static_cast<std::int32_t>(a - b) < 0;
}

}  // namespace clothstream::sctp
