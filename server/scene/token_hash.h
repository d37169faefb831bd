// SPDX-License-Identifier: MIT
// Hash by which the server recognises a resume token that it does not store.
#pragma once

#include <string>
#include <string_view>

namespace clothstream::scene {

inline constexpr std::size_t kTokenHashBytes = 32;

// SHA-256. A token has 128 random bits, so that its hash does not help to find it.
std::string hashOfToken(std::string_view token);

}  // namespace clothstream::scene
