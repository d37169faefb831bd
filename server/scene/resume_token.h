// SPDX-License-Identifier: MIT
// Resume tokens, with which participants come back, and the hashes by which the server recognises them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace clothstream::scene {

inline constexpr std::size_t kTokenBytes = 16, kTokenHashBytes = 32;

// 128 random bits from the system, so that the token cannot be guessed.
std::string makeToken();

// SHA-256. A token has 128 random bits, so that its hash does not help to find it.
std::string hashOfToken(std::string_view token);

// Constant-time comparison.
bool isSameHash(std::string_view one, std::string_view other);

}  // namespace clothstream::scene
