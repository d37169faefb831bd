// SPDX-License-Identifier: MIT
// Zigzag form: signed numbers as unsigned ones.
#pragma once

#include <cstdint>

namespace clothstream::codec {

// Maps 0, -1, 1, -2, ... to 0, 1, 2, 3, ..., so that small magnitudes of either sign become small numbers.
constexpr std::uint32_t zigzag(std::int32_t value) {
  return (static_cast<std::uint32_t>(value) << 1) ^ static_cast<std::uint32_t>(value >> 31);
}
constexpr std::int32_t unzigzag(std::uint32_t value) {
  return static_cast<std::int32_t>((value >> 1) ^ (0u - (value & 1u)));
}

}  // namespace clothstream::codec
