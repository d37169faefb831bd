// SPDX-License-Identifier: MIT
// Names as people see them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "proto/text/printable.h"
#include "proto/text/utf8.h"

namespace clothstream {

// First and last characters of a range.
using CharacterRange = std::pair<std::uint32_t, std::uint32_t>;

// Characters that show as a space: White_Space of Unicode, and the blank pattern of Braille.
inline constexpr std::array<CharacterRange, 8> kSpaces{{{0x20, 0x20},
                                                        {0xa0, 0xa0},
                                                        {0x1680, 0x1680},
                                                        {0x2000, 0x200a},
                                                        {0x202f, 0x202f},
                                                        {0x205f, 0x205f},
                                                        {0x2800, 0x2800},
                                                        {0x3000, 0x3000}}};
// Pictures, which a joiner makes one of.
inline constexpr std::array<CharacterRange, 2> kPictures{{{0x2190, 0x2bff}, {0x1f000, 0x1faff}}};

constexpr bool isIn(std::span<const CharacterRange> ranges, std::uint32_t character) {
  return std::ranges::any_of(ranges, [&](const CharacterRange& range) {
    return character >= range.first && character <= range.second;
  });
}

// Returns the text without what nobody sees, so that two names that look alike are not different because of
// it: characters that show nothing, and spaces at its ends. Other spaces become single ones (U+0020). A
// joiner (U+200D) stays between two pictures. `text` must be well-formed UTF-8.
inline std::string visible(std::string_view text) {
  constexpr std::uint32_t kJoiner = 0x200d;
  std::string shown;
  std::string_view waiting;  // a space or joiner, which stays if something visible follows
  std::uint32_t before = 0;  // the newest character that stays
  while (!text.empty()) {
    const std::size_t bytes = std::max<std::size_t>(1, characterBytes(text));
    const std::string_view character = text.substr(0, bytes);
    const std::uint32_t code = codePointOf(character);
    text.remove_prefix(bytes);
    if (isIn(kSpaces, code)) {
      waiting = shown.empty() ? std::string_view() : std::string_view(" ");
    } else if (code == kJoiner && isIn(kPictures, before) && waiting.empty()) {
      waiting = character;
    } else if (!isInvisible(code)) {
      if (waiting == " " || isIn(kPictures, code)) shown += waiting;
      waiting = {};
      shown += character;
      before = code;
    }
  }
  return shown;
}

}  // namespace clothstream
