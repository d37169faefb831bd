// SPDX-License-Identifier: MIT
// Glyphs of the fonts of the system, drawn by FreeType and chosen by Fontconfig.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace clothstream::xr {

enum class Weight : std::uint32_t { kRegular = 0, kBold = 1 };

struct Glyph {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> coverage;  // one byte per pixel, rows from the top
  int left = 0, top = 0;               // of the bitmap: to the right of the pen, and above the base line
  float advance = 0;                   // of the pen, pixels
};

// Not thread-safe. Glyphs are kept, up to a limit.
class Fonts {
 public:
  // As the constructor of TextPainter.
  explicit Fonts(const std::string& fontFile);
  ~Fonts();
  Fonts(const Fonts&) = delete;
  Fonts& operator=(const Fonts&) = delete;

  // Glyph of the first font that has the character, else the box for missing characters of the first font.
  // Valid until the next call.
  const Glyph& glyph(char32_t character, std::uint32_t pixels, Weight weight);
  // Height of capital letters, pixels.
  float capHeight(std::uint32_t pixels, Weight weight);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

// Takes the next character off the start of a text. Malformed UTF-8 gives U+FFFD for each byte.
char32_t nextCharacter(std::string_view& utf8);

}  // namespace clothstream::xr
