// SPDX-License-Identifier: MIT
// Text from outside that is shown to people.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
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

// Code point of a well-formed character of this number of bytes; of a single byte its value.
constexpr std::uint32_t codePointOf(std::string_view character) {
  const auto at = [&](std::size_t i) -> std::uint32_t { return static_cast<unsigned char>(character[i]); };
  switch (character.size()) {
    case 2:
      return (at(0) & 0x1f) << 6 | (at(1) & 0x3f);
    case 3:
      return (at(0) & 0x0f) << 12 | (at(1) & 0x3f) << 6 | (at(2) & 0x3f);
    case 4:
      return (at(0) & 0x07) << 18 | (at(1) & 0x3f) << 12 | (at(2) & 0x3f) << 6 | (at(3) & 0x3f);
    default:
      return at(0);
  }
}

// Whether a character has no width or no picture, so that a text with it looks like another text.
constexpr bool isInvisible(std::uint32_t codePoint) {
  constexpr struct {
    std::uint32_t first, last;
  } kInvisible[] = {{0x00ad, 0x00ad},     // soft hyphen
                    {0x034f, 0x034f},     // combining grapheme joiner
                    {0x115f, 0x1160},     // fillers of Hangul
                    {0x17b4, 0x17b5},     // inherent vowels of Khmer
                    {0x180b, 0x180f},     // selectors and separator of Mongolian
                    {0x200b, 0x200f},     // zero-width space, joiners, direction
                    {0x2028, 0x202e},     // ends of lines and paragraphs, direction
                    {0x2060, 0x206f},     // word joiner, invisible operators, isolates, deprecated
                    {0x3164, 0x3164},     // filler of Hangul
                    {0xfe00, 0xfe0f},     // selectors of variants
                    {0xfeff, 0xfeff},     // byte-order mark
                    {0xffa0, 0xffa0},     // filler of Hangul
                    {0xfff0, 0xfffb},     // annotations
                    {0xe0000, 0xe0fff}};  // tags, selectors of variants
  for (const auto& range : kInvisible)
    if (codePoint >= range.first && codePoint <= range.last) return true;
  return false;
}

// Number of bytes at the start of `text` that must not be shown as they are: a control character, or one that
// is invisible; 0 if the first character is harmless.
constexpr std::size_t unprintableAt(std::string_view text) {
  if (const std::size_t control = controlCharacterAt(text); control > 0) return control;
  const std::size_t bytes = characterBytes(text);
  return bytes > 1 && isInvisible(codePointOf(text.substr(0, bytes))) ? bytes : 0;
}

// Replaces each character that must not be shown by the text that `escape` gives for it.
template <typename Escape>
std::string escaped(std::string_view text, const Escape& escape) {
  std::string shown;
  while (!text.empty()) {
    const std::size_t hidden = unprintableAt(text);
    const std::size_t bytes = hidden > 0 ? hidden : std::max<std::size_t>(1, characterBytes(text));
    if (hidden > 0)
      shown += escape(text.substr(0, hidden));
    else
      shown += text.substr(0, bytes);
    text.remove_prefix(bytes);
  }
  return shown;
}

// Number in hexadecimal with this many digits.
inline std::string hexDigits(std::uint32_t number, int digits) {
  std::string text;
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4)
    text += "0123456789abcdef"[(number >> shift) & 15];
  return text;
}

// One line: writes each byte of a control character or an invisible one as \\xNN, and keeps all other text.
inline std::string printable(std::string_view text) {
  return escaped(text, [](std::string_view character) {
    std::string shown;
    for (const char c : character) shown += "\\x" + hexDigits(static_cast<unsigned char>(c), 2);
    return shown;
  });
}

// The same for several lines: their ends are kept.
inline std::string printableLines(std::string_view text) {
  std::string shown;
  for (;;) {
    const std::size_t end = text.find('\n');
    shown += printable(text.substr(0, end));
    if (end == text.npos) return shown;
    shown += '\n';
    text.remove_prefix(end + 1);
  }
}

// The same for JSON, of which all texts are UTF-8: a character is written as \\uXXXX, which means the same.
// Ends of lines are kept.
inline std::string printableJson(std::string_view json) {
  return escaped(json, [](std::string_view character) -> std::string {
    const std::uint32_t point = codePointOf(character);
    if (point == '\n') return "\n";
    if (point < 0x10000) return "\\u" + hexDigits(point, 4);
    const std::uint32_t rest = point - 0x10000;
    return "\\u" + hexDigits(0xd800 + (rest >> 10), 4) + "\\u" + hexDigits(0xdc00 + (rest & 0x3ff), 4);
  });
}

}  // namespace clothstream
