// SPDX-License-Identifier: MIT
// STUN messages with any attributes, which writeStun() would not write.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include "proto/checksum/crc32.h"
#include "proto/ice/stun_message.h"

namespace clothstream::ice {

inline void appendNumber(std::vector<std::byte>& bytes, std::uint64_t number, std::size_t size) {
  for (std::size_t i = size; i-- > 0;) bytes.push_back(static_cast<std::byte>(number >> (8 * i)));
}

// Appends an attribute, padded.
inline void appendAttribute(std::vector<std::byte>& bytes, std::uint16_t type,
                            std::span<const std::byte> value) {
  appendNumber(bytes, type, 2);
  appendNumber(bytes, value.size(), 2);
  bytes.insert(bytes.end(), value.begin(), value.end());
  bytes.resize((bytes.size() + 3) / 4 * 4);
}

// A message with these bytes between the header and a right MESSAGE-INTEGRITY and FINGERPRINT. Without a
// password it has no MESSAGE-INTEGRITY.
inline std::vector<std::byte> sealed(StunKind kind, std::span<const std::byte> attributes,
                                     std::string_view password) {
  std::vector<std::byte> bytes;
  appendNumber(bytes, static_cast<std::uint64_t>(kind), 2);
  appendNumber(bytes, 0, 2);
  appendNumber(bytes, 0x2112A442, 4);
  bytes.resize(20, std::byte{7});
  bytes.insert(bytes.end(), attributes.begin(), attributes.end());
  bytes.resize((bytes.size() + 3) / 4 * 4);
  const auto setLength = [&](std::size_t more) {
    const std::size_t length = bytes.size() - 20 + more;
    bytes[2] = static_cast<std::byte>(length >> 8);
    bytes[3] = static_cast<std::byte>(length);
  };
  if (!password.empty()) {
    setLength(24);
    std::array<unsigned char, 20> hash{};
    HMAC(EVP_sha1(), password.data(), static_cast<int>(password.size()),
         reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), hash.data(), nullptr);
    appendAttribute(bytes, 0x0008, std::as_bytes(std::span(hash)));
  }
  setLength(8);
  const std::uint32_t crc = checksum::crc32({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  appendNumber(bytes, 0x8028, 2);
  appendNumber(bytes, 4, 2);
  appendNumber(bytes, crc ^ 0x5354554E, 4);
  return bytes;
}

}  // namespace clothstream::ice
