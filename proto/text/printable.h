// SPDX-License-Identifier: MIT
// Text from outside that is shown to people.
#pragma once

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

#include "proto/text/utf8.h"

namespace clothstream {

// Number of bytes at the start of `text` that are one character which can control a terminal, forge a line of
// a log, or change how other text reads; 0 if the first character is harmless. These are U+0000 to U+001F,
// U+007F to U+009F, and the marks that change direction or break lines: U+061C, U+200E, U+200F, U+2028 to
// U+202E, U+2066 to U+2069. Bytes 0x80 to 0x9F that are not part of a character count as U+0080 to U+009F,
// because some terminals read them so.
constexpr std::size_t controlCharacterAt(std::string_view text) {
  const auto at = [&](std::size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0x100u;
  };
  if (at(0) < 0x20 || at(0) == 0x7f) return 1;
  if (at(0) >= 0x80 && at(0) < 0xa0) return 1;
  if (at(0) == 0xc2 && at(1) >= 0x80 && at(1) < 0xa0) return 2;
  if (at(0) == 0xd8 && at(1) == 0x9c) return 2;
  if (at(0) != 0xe2) return 0;
  const bool isMark =
      (at(1) == 0x80 && (at(2) == 0x8e || at(2) == 0x8f || (at(2) >= 0xa8 && at(2) <= 0xae))) ||
      (at(1) == 0x81 && at(2) >= 0xa6 && at(2) <= 0xa9);
  return isMark ? 3 : 0;
}

constexpr bool hasControlCharacters(std::string_view text) {
  for (; !text.empty(); text.remove_prefix(std::max<std::size_t>(1, characterBytes(text))))
    if (controlCharacterAt(text) > 0) return true;
  return false;
}

// Writes each byte of a control character as \\xNN, and keeps all other text.
inline std::string printable(std::string_view text) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string shown;
  while (!text.empty()) {
    const std::size_t control = controlCharacterAt(text);
    for (const char c : text.substr(0, control)) {
      const auto byte = static_cast<unsigned char>(c);
      shown += {'\\', 'x', kDigits[byte >> 4], kDigits[byte & 15]};
    }
    const std::size_t bytes = control > 0 ? control : std::max<std::size_t>(1, characterBytes(text));
    if (control == 0) shown += text.substr(0, bytes);
    text.remove_prefix(bytes);
  }
  return shown;
}

}  // namespace clothstream
