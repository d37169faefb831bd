// SPDX-License-Identifier: MIT
// CRC-32 of stored states, which finds damage.
#pragma once

#include <cstdint>
#include <string_view>

#include <zlib.h>

namespace clothstream::saved_state {

inline std::uint32_t crcOf(std::string_view bytes) {
  return static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

}  // namespace clothstream::saved_state
