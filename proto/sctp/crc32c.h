// SPDX-License-Identifier: MIT
// CRC-32C, the checksum of SCTP packets (RFC 9260, appendix A).
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "proto/checksum/crc32.h"

namespace clothstream::sctp {

// CRC-32C of the bytes, continued from `before`. Most packets need none: browsers accept a checksum of zero
// over DTLS (RFC 9653).
inline std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t before = 0) {
  return checksum::crc<0x82f63b78>({reinterpret_cast<const char*>(bytes.data()), bytes.size()}, before);
}

}  // namespace clothstream::sctp
