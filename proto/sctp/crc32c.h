// SPDX-License-Identifier: MIT
// CRC-32C, the checksum of SCTP packets (RFC 9260, appendix A).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace clothstream::sctp {

// Table k gives the CRC of a byte that k zero bytes follow.
inline constexpr auto kCrc32cTables = [] {
  constexpr std::uint32_t kPolynomial = 0x82f63b78;  // reversed
  std::array<std::array<std::uint32_t, 256>, 8> tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t crc = byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ (crc & 1 ? kPolynomial : 0);
    tables[0][byte] = crc;
  }
  for (std::size_t k = 1; k < tables.size(); ++k)
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[k - 1][byte];
      tables[k][byte] = before >> 8 ^ tables[0][before & 0xff];
    }
  return tables;
}();

// CRC-32C of the bytes, continued from `before`. Eight bytes a step. Most packets need none: browsers accept
// a checksum of zero over DTLS (RFC 9653).
inline std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t before = 0) {
  const auto byte = [&](std::size_t i) { return std::to_integer<std::uint32_t>(bytes[i]); };
  std::uint32_t crc = ~before;
  for (; bytes.size() >= 8; bytes = bytes.subspan(8)) {
    const std::uint32_t low = crc ^ (byte(0) | byte(1) << 8 | byte(2) << 16 | byte(3) << 24);
    crc = kCrc32cTables[7][low & 0xff] ^ kCrc32cTables[6][low >> 8 & 0xff] ^
          kCrc32cTables[5][low >> 16 & 0xff] ^ kCrc32cTables[4][low >> 24] ^ kCrc32cTables[3][byte(4)] ^
          kCrc32cTables[2][byte(5)] ^ kCrc32cTables[1][byte(6)] ^ kCrc32cTables[0][byte(7)];
  }
  for (const std::byte last : bytes)
    crc = crc >> 8 ^ kCrc32cTables[0][(crc ^ std::to_integer<std::uint32_t>(last)) & 0xff];
  return ~crc;
}

}  // namespace clothstream::sctp
