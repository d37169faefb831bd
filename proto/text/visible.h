// SPDX-License-Identifier: MIT
// Names as people see them.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "proto/text/utf8.h"

namespace clothstream {

// First and last characters of a range.
using CharacterRange = std::pair<char32_t, char32_t>;

// Characters that show nothing: Default_Ignorable_Code_Point of Unicode 15, interlinear annotations, and the
// blank pattern of Braille.
inline constexpr std::array<CharacterRange, 19> kInvisible{{{0xad, 0xad},
                                                            {0x34f, 0x34f},
                                                            {0x61c, 0x61c},
                                                            {0x115f, 0x1160},
                                                            {0x17b4, 0x17b5},
                                                            {0x180b, 0x180f},
                                                            {0x200b, 0x200f},
                                                            {0x202a, 0x202e},
                                                            {0x2060, 0x206f},
                                                            {0x2800, 0x2800},
                                                            {0x3164, 0x3164},
                                                            {0xfe00, 0xfe0f},
                                                            {0xfeff, 0xfeff},
                                                            {0xffa0, 0xffa0},
                                                            {0xfff0, 0xfffb},
                                                            {0x1bca0, 0x1bca3},
                                                            {0x1d173, 0x1d17a},
                                                            {0xe0000, 0xe0fff},
                                                            {0x13430, 0x1343f}}};
// Characters that show as a space (White_Space).
inline constexpr std::array<CharacterRange, 7> kSpaces{{{0x20, 0x20},
                                                        {0xa0, 0xa0},
                                                        {0x1680, 0x1680},
                                                        {0x2000, 0x200a},
                                                        {0x202f, 0x202f},
                                                        {0x205f, 0x205f},
                                                        {0x3000, 0x3000}}};
// Pictures, after which a joiner or a choice of their style has an effect.
inline constexpr std::array<CharacterRange, 2> kPictures{{{0x2190, 0x2bff}, {0x1f000, 0x1faff}}};

constexpr bool isIn(std::span<const CharacterRange> ranges, char32_t character) {
  return std::ranges::any_of(ranges, [&](const CharacterRange& range) {
    return character >= range.first && character <= range.second;
  });
}

// The first character of well-formed UTF-8.
constexpr char32_t characterAt(std::string_view text) {
  const std::size_t bytes = characterBytes(text);
  const auto at = [&](std::size_t i) -> char32_t { return static_cast<unsigned char>(text[i]); };
  if (bytes < 2) return bytes == 0 ? 0 : at(0);
  char32_t character = at(0) & (0x7fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) character = character << 6 | (at(i) & 0x3fu);
  return character;
}

// Returns the text without what nobody sees, so that two names that look alike are not different because of
// it: characters that show nothing, and spaces at its ends. Other spaces become single ones (U+0020). Joiners
// (U+200D) and styles (U+FE0E, U+FE0F) stay where they form one picture. `text` must be well-formed UTF-8.
inline std::string visible(std::string_view text) {
  constexpr char32_t kJoiner = 0x200d, kTextStyle = 0xfe0e, kPictureStyle = 0xfe0f;
  std::string shown;
  std::string_view waiting;  // a space or joiner, which stays if something visible follows
  char32_t before = 0;       // the newest character that stays
  while (!text.empty()) {
    const std::size_t bytes = std::max<std::size_t>(1, characterBytes(text));
    const std::string_view character = text.substr(0, bytes);
    const char32_t code = characterAt(text);
    text.remove_prefix(bytes);
    const bool afterPicture = isIn(kPictures, before);
    if (isIn(kSpaces, code)) {
      waiting = shown.empty() ? std::string_view() : std::string_view(" ");
    } else if ((code == kTextStyle || code == kPictureStyle) && afterPicture && waiting.empty()) {
      shown += character;
      before = code;
    } else if (code == kJoiner && (afterPicture || before == kPictureStyle) && waiting.empty()) {
      waiting = character;
    } else if (!isIn(kInvisible, code)) {
      if (waiting == " " || isIn(kPictures, code)) shown += waiting;
      waiting = {};
      shown += character;
      before = code;
    }
  }
  return shown;
}

}  // namespace clothstream
