// SPDX-License-Identifier: MIT
#include "clients/xr/text/painter.h"

#include <algorithm>
#include <cmath>

namespace clothstream::xr {
namespace {

constexpr std::string_view kEllipsis = "\u2026";

// Sizes of a label over a head, in texels.
constexpr float kLabelPixels = 40;
constexpr std::uint32_t kLabelHeight = 72, kLabelPadding = 26, kLabelMost = 640;

std::uint32_t whole(float pixels) {
  return static_cast<std::uint32_t>(std::max(1.0F, std::round(pixels)));
}

// Lays ink with this coverage (0 to 255) over a texel.
void blend(std::uint8_t* texel, Ink ink, std::uint32_t coverage) {
  const std::uint32_t alpha = coverage * ink.alpha / 255;
  const auto mix = [&](std::uint8_t below, std::uint32_t above) {
    return static_cast<std::uint8_t>((above * alpha + below * (255 - alpha) + 127) / 255);
  };
  texel[0] = mix(texel[0], ink.red);
  texel[1] = mix(texel[1], ink.green);
  texel[2] = mix(texel[2], ink.blue);
  texel[3] = mix(texel[3], 255);
}

void drawGlyph(Picture& picture, const Glyph& glyph, int left, int top, Ink ink) {
  for (std::uint32_t row = 0; row < glyph.height; ++row) {
    const int y = top + static_cast<int>(row);
    if (y < 0 || y >= static_cast<int>(picture.height)) continue;
    for (std::uint32_t column = 0; column < glyph.width; ++column) {
      const int x = left + static_cast<int>(column);
      if (x < 0 || x >= static_cast<int>(picture.width)) continue;
      const std::size_t at = static_cast<std::size_t>(y) * picture.width + static_cast<std::size_t>(x);
      blend(&picture.texels[4 * at], ink, glyph.coverage[std::size_t{row} * glyph.width + column]);
    }
  }
}

// Distance of a point from the edge of a rounded rectangle; negative inside.
float distanceFrom(float x, float y, float halfWidth, float halfHeight, float radius) {
  const float dx = std::abs(x) - halfWidth + radius;
  const float dy = std::abs(y) - halfHeight + radius;
  return std::hypot(std::max(dx, 0.0F), std::max(dy, 0.0F)) + std::min(std::max(dx, dy), 0.0F) - radius;
}

}  // namespace

TextPainter::TextPainter(const std::string& fontFile)
    : fontFile_(fontFile), fonts_(std::make_unique<Fonts>(fontFile)) {}
TextPainter::~TextPainter() = default;

float TextPainter::width(std::string_view utf8, float pixels, Weight weight) {
  float width = 0;
  while (!utf8.empty()) width += fonts_->glyph(nextCharacter(utf8), whole(pixels), weight).advance;
  return width;
}

void TextPainter::warm(float pixels, Weight weight) {
  for (char32_t character = U' '; character <= U'~'; ++character)
    fonts_->glyph(character, whole(pixels), weight);
  width(kEllipsis, pixels, weight);
}

TextPainter::Fitted TextPainter::fit(std::string_view utf8, float pixels, float most, Weight weight) {
  const float ellipsis = width(kEllipsis, pixels, weight);
  // The longest part that leaves room for the ellipsis, in case that there is more.
  std::size_t kept = 0;
  float keptWidth = 0, used = 0;
  std::string_view rest = utf8;
  while (!rest.empty()) {
    used += fonts_->glyph(nextCharacter(rest), whole(pixels), weight).advance;
    if (used > most) return {utf8.substr(0, kept), true, keptWidth + ellipsis};
    if (used > most - ellipsis) continue;
    kept = utf8.size() - rest.size();
    keptWidth = used;
  }
  return {utf8, false, used};
}

void TextPainter::wrap(std::string_view utf8, float pixels, float most, std::size_t lines,
                       std::vector<std::string_view>& out) {
  out.assign(1, utf8.substr(0, 0));
  const float space = width(" ", pixels);
  float used = 0;  // of the last line
  for (std::size_t begin = 0; begin < utf8.size();) {
    const std::size_t end = std::min(utf8.find(' ', begin), utf8.size());
    const std::string_view word = utf8.substr(begin, end - begin);
    const float wordWidth = width(word, pixels);
    std::string_view& line = out.back();
    const auto lineStart = static_cast<std::size_t>(line.data() - utf8.data());
    if (line.empty()) {
      line = word;
      used = wordWidth;
    } else if (out.size() == lines) {
      line = utf8.substr(lineStart);
      return;
    } else if (used + space + wordWidth <= most) {
      line = utf8.substr(lineStart, end - lineStart);
      used += space + wordWidth;
    } else {
      out.push_back(word);
      used = wordWidth;
    }
    begin = end + 1;
  }
}

void TextPainter::write(Picture& picture, std::string_view utf8, float x, float y, float pixels, Ink ink,
                        Align align, Weight weight, float most) {
  const std::uint32_t size = whole(pixels);
  const Fitted fitted = fit(utf8, pixels, most, weight);
  if (align != Align::kLeft) x -= fitted.width * (align == Align::kCentre ? 0.5F : 1.0F);
  const int baseLine = static_cast<int>(std::lround(y + fonts_->capHeight(size, weight) / 2));
  for (std::string_view part : {fitted.text, fitted.isCut ? kEllipsis : std::string_view()}) {
    while (!part.empty()) {
      const Glyph& glyph = fonts_->glyph(nextCharacter(part), size, weight);
      drawGlyph(picture, glyph, static_cast<int>(std::lround(x)) + glyph.left, baseLine - glyph.top, ink);
      x += glyph.advance;
    }
  }
}

std::shared_ptr<const Picture> TextPainter::label(std::string_view name, Ink border) {
  auto picture = std::make_shared<Picture>();
  constexpr float kRoom = kLabelMost - 2 * kLabelPadding;
  const auto textWidth =
      static_cast<std::uint32_t>(std::ceil(fit(name, kLabelPixels, kRoom, Weight::kBold).width));
  clear(*picture, std::min(kLabelMost, textWidth + 2 * kLabelPadding), kLabelHeight);
  const auto wide = static_cast<float>(picture->width);
  constexpr auto kHigh = static_cast<float>(kLabelHeight);
  drawRounded(*picture, 0, 0, wide, kHigh, kHigh / 2, {0x14, 0x16, 0x1b, 0xd8});
  drawRounded(*picture, 1, 1, wide - 2, kHigh - 2, kHigh / 2 - 1, border, 4);
  write(*picture, name, wide / 2, kHigh / 2, kLabelPixels, {0xf4, 0xf2, 0xee, 255}, Align::kCentre,
        Weight::kBold, kRoom);
  touch(*picture);
  return picture;
}

void drawRounded(Picture& picture, float left, float top, float width, float height, float radius, Ink ink,
                 float line) {
  const float halfWidth = width / 2, halfHeight = height / 2;
  const int firstRow = std::max(0, static_cast<int>(std::floor(top)));
  const int lastRow = std::min(static_cast<int>(picture.height), static_cast<int>(std::ceil(top + height)));
  const int first = std::max(0, static_cast<int>(std::floor(left)));
  const int last = std::min(static_cast<int>(picture.width), static_cast<int>(std::ceil(left + width)));
  for (int row = firstRow; row < lastRow; ++row) {
    std::uint8_t* texel =
        &picture
             .texels[4 * (static_cast<std::size_t>(row) * picture.width + static_cast<std::size_t>(first))];
    for (int column = first; column < last; ++column, texel += 4) {
      const float x = static_cast<float>(column) + 0.5F - left - halfWidth;
      const float y = static_cast<float>(row) + 0.5F - top - halfHeight;
      const float distance = distanceFrom(x, y, halfWidth, halfHeight, radius);
      float inside = std::clamp(0.5F - distance, 0.0F, 1.0F);
      if (line > 0) inside = std::min(inside, std::clamp(0.5F + distance + line, 0.0F, 1.0F));
      if (inside > 0) blend(texel, ink, static_cast<std::uint32_t>(std::lround(255 * inside)));
    }
  }
}

}  // namespace clothstream::xr
