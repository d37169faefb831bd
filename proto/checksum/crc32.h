// SPDX-License-Identifier: MIT
// CRC-32 as in zip files and STUN, and others of 32 bits. WebAssembly has no zlib, and all builds use the
// same code.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace clothstream::checksum {

// Table k gives the CRC of a byte that k zero bytes follow. The polynomial is reversed.
template <std::uint32_t kPolynomial>
inline constexpr auto kCrcTables = [] {
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

// CRC with this reversed polynomial, continued from `before`. Eight bytes a step.
template <std::uint32_t kPolynomial>
std::uint32_t crc(std::string_view bytes, std::uint32_t before) {
  constexpr auto& kTables = kCrcTables<kPolynomial>;
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(bytes[i]); };
  std::uint32_t sum = ~before;
  while (bytes.size() >= 8) {
    const std::uint32_t low = sum ^ (byte(0) | std::uint32_t{byte(1)} << 8 | std::uint32_t{byte(2)} << 16 |
                                     std::uint32_t{byte(3)} << 24);
    sum = kTables[7][low & 0xff] ^ kTables[6][low >> 8 & 0xff] ^ kTables[5][low >> 16 & 0xff] ^
          kTables[4][low >> 24] ^ kTables[3][byte(4)] ^ kTables[2][byte(5)] ^ kTables[1][byte(6)] ^
          kTables[0][byte(7)];
    bytes.remove_prefix(8);
  }
  for (const char last : bytes) sum = sum >> 8 ^ kTables[0][(sum ^ static_cast<std::uint8_t>(last)) & 0xff];
  return ~sum;
}

// CRC-32 of the bytes, continued from `before`.
inline std::uint32_t crc32(std::string_view bytes, std::uint32_t before = 0) {
  return crc<0xedb88320>(bytes, before);
}

}  // namespace clothstream::checksum
