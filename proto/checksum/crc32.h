// SPDX-License-Identifier: MIT
// CRC-32 as in zip files and STUN. WebAssembly has no zlib, and all builds use the same code.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace clothstream::checksum {

// Table k gives the CRC of a byte that k zero bytes follow.
inline constexpr auto kCrcTables = [] {
  constexpr std::uint32_t kPolynomial = 0xedb88320;  // reversed
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

// CRC-32 of the bytes, continued from `before`. Eight bytes a step.
inline std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes[i]); };
  std::uint32_t crc = ~before;
  while (bytes.size() >= 8) {
    const std::uint32_t low = crc ^ (byte(0) | std::uint32_t{byte(1)} << 8 | std::uint32_t{byte(2)} << 16 |
                                     std::uint32_t{byte(3)} << 24);
    crc = kCrcTables[7][low & 0xff] ^ kCrcTables[6][low >> 8 & 0xff] ^ kCrcTables[5][low >> 16 & 0xff] ^
          kCrcTables[4][low >> 24] ^ kCrcTables[3][byte(4)] ^ kCrcTables[2][byte(5)] ^
          kCrcTables[1][byte(6)] ^ kCrcTables[0][byte(7)];
    bytes.remove_prefix(8);
  }
  for (const char last : bytes)
    crc = crc >> 8 ^ kCrcTables[0][(crc ^ static_cast<std::uint8_t>(last)) & 0xff];
  return ~crc;
}

}  // namespace clothstream::checksum
