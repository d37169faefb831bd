// SPDX-License-Identifier: MIT
// Checks the encoding of text from outside.
#pragma once

#include <cstddef>
#include <string_view>

namespace clothstream {

// Returns whether the text is well-formed UTF-8 (Unicode 15, table 3-7): no surrogates, nothing beyond
// U+10FFFF, no longer form of a character than needed.
constexpr bool isUtf8(std::string_view text) {
  std::size_t i = 0;
  const auto at = [&](std::size_t k) -> unsigned {
    return i + k < text.size() ? static_cast<unsigned char>(text[i + k]) : 0u;
  };
  const auto follows = [&](std::size_t k) { return (at(k) & 0xc0u) == 0x80; };
  while (i < text.size()) {
    const unsigned first = at(0), second = at(1);
    if (first < 0x80) {
      i += 1;
    } else if (first >= 0xc2 && first < 0xe0 && follows(1)) {
      i += 2;
    } else if (first >= 0xe0 && first < 0xf0 && follows(1) && follows(2) &&
               (first != 0xe0 || second >= 0xa0) && (first != 0xed || second < 0xa0)) {
      i += 3;
    } else if (first >= 0xf0 && first < 0xf5 && follows(1) && follows(2) && follows(3) &&
               (first != 0xf0 || second >= 0x90) && (first != 0xf4 || second < 0x90)) {
      i += 4;
    } else {
      return false;
    }
  }
  return true;
}

}  // namespace clothstream
