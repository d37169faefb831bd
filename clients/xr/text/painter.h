// SPDX-License-Identifier: MIT
// Draws texts and rounded rectangles into pictures, with FreeType and the fonts of the system.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "clients/xr/text/fonts.h"
#include "clients/xr/text/picture.h"

namespace clothstream::xr {

// sRGB with straight alpha.
struct Ink {
  std::uint8_t red = 255, green = 255, blue = 255, alpha = 255;
};

enum class Align { kLeft, kCentre, kRight };

// Not thread-safe.
class TextPainter {
 public:
  // Uses the font file, or the sans-serif fonts of the system if `fontFile` is "". Throws std::runtime_error
  // that says what to install if there is no font.
  explicit TextPainter(const std::string& fontFile = "");
  ~TextPainter();
  TextPainter(const TextPainter&) = delete;
  TextPainter& operator=(const TextPainter&) = delete;

  const std::string& fontFile() const { return fontFile_; }
  // Width of a text in pixels. `pixels` is the size of the font.
  float width(std::string_view utf8, float pixels, Weight weight = Weight::kRegular);
  // Loads the glyphs of ASCII, so that texts of them allocate nothing later.
  void warm(float pixels, Weight weight);
  // Replaces `out` by the parts of the text that are its lines of at most `most` pixels, 1 to `lines` of
  // them. A word that is wider, and the last line if there is more, are cut when they are drawn.
  void wrap(std::string_view utf8, float pixels, float most, std::size_t lines,
            std::vector<std::string_view>& out);
  // Part of a text that is drawn within `most` pixels: all of it, or its start, which an ellipsis follows.
  struct Fitted {
    std::string_view text;
    bool isCut = false;
    float width = 0;  // with the ellipsis, pixels
  };
  Fitted fit(std::string_view utf8, float pixels, float most, Weight weight = Weight::kRegular);
  // Draws a text at `x`, vertically centred at `y` on the height of capital letters, and cuts it if it is
  // wider than `most` pixels. Characters that no font has are drawn as boxes; malformed UTF-8 as U+FFFD.
  void write(Picture& picture, std::string_view utf8, float x, float y, float pixels, Ink ink,
             Align align = Align::kLeft, Weight weight = Weight::kRegular,
             float most = std::numeric_limits<float>::infinity());

  // A name in a pill with a border of this colour, for a label in space.
  std::shared_ptr<const Picture> label(std::string_view name, Ink border);

 private:
  std::string fontFile_;
  std::unique_ptr<Fonts> fonts_;
};

// Makes a picture of this size transparent, and keeps its memory.
void clear(Picture& picture, std::uint32_t width, std::uint32_t height);
// Draws a rectangle with round corners over the picture. `line` is the width of an outline; 0 fills the
// rectangle.
void drawRounded(Picture& picture, float left, float top, float width, float height, float radius, Ink ink,
                 float line = 0);
// Gives the picture a new revision.
void touch(Picture& picture);

}  // namespace clothstream::xr
