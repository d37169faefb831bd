// SPDX-License-Identifier: MIT
// Checks the encoding of text from outside.
#pragma once

#include <cstddef>
#include <string_view>

namespace clothstream {

// Number of bytes of the first character of well-formed UTF-8 (Unicode 15, table 3-7): no surrogates, nothing
// beyond U+10FFFF, no longer form of a character than needed. 0 if the text is empty or begins otherwise.
constexpr std::size_t characterBytes(std::string_view text) {
  const auto at = [&](std::size_t i) -> unsigned {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const auto follows = [&](std::size_t i) { return (at(i) & 0xc0u) == 0x80; };
  const unsigned first = at(0), second = at(1);
  if (text.empty()) return 0;
  if (first < 0x80) return 1;
  if (first >= 0xc2 && first < 0xe0 && follows(1)) return 2;
  if (first >= 0xe0 && first < 0xf0 && follows(1) && follows(2) && (first != 0xe0 || second >= 0xa0) &&
      (first != 0xed || second < 0xa0))
    return 3;
  if (first >= 0xf0 && first < 0xf5 && follows(1) && follows(2) && follows(3) &&
      (first != 0xf0 || second >= 0x90) && (first != 0xf4 || second < 0x90))
    return 4;
  return 0;
}

// Returns whether the text is well-formed UTF-8.
constexpr bool isUtf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t bytes = characterBytes(text);
    if (bytes == 0) return false;
    text.remove_prefix(bytes);
  }
  return true;
}

}  // namespace clothstream
