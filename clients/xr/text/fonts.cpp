// SPDX-License-Identifier: MIT
#include "clients/xr/text/fonts.h"

#include <array>
#include <map>
#include <stdexcept>
#include <tuple>

#include <fmt/format.h>
#include <fontconfig/fontconfig.h>
#include <ft2build.h>
#include FT_FREETYPE_H

namespace clothstream::xr {
namespace {

constexpr char32_t kReplacement = 0xFFFD;
constexpr std::size_t kMostFonts = 64;     // of the system's order of preference, per weight
constexpr std::size_t kMostGlyphs = 4096;  // names of other people can have any characters

struct Source {
  std::string file;
  int index = 0;  // in a collection
  FT_Face face = nullptr;
  bool failed = false;
};

// Files of the system's sans-serif fonts, the preferred one first.
std::vector<Source> systemFonts(Weight weight) {
  FcPattern* pattern = FcPatternCreate();
  FcPatternAddString(pattern, FC_FAMILY, reinterpret_cast<const FcChar8*>("sans-serif"));
  FcPatternAddInteger(pattern, FC_WEIGHT, weight == Weight::kBold ? FC_WEIGHT_DEMIBOLD : FC_WEIGHT_REGULAR);
  FcPatternAddBool(pattern, FC_SCALABLE, FcTrue);
  FcConfigSubstitute(nullptr, pattern, FcMatchPattern);
  FcDefaultSubstitute(pattern);
  FcResult result = FcResultMatch;
  FcFontSet* set = FcFontSort(nullptr, pattern, FcTrue, nullptr, &result);
  std::vector<Source> sources;
  for (int i = 0; set != nullptr && i < set->nfont && sources.size() < kMostFonts; ++i) {
    FcChar8* file = nullptr;
    int index = 0;
    if (FcPatternGetString(set->fonts[i], FC_FILE, 0, &file) != FcResultMatch) continue;
    FcPatternGetInteger(set->fonts[i], FC_INDEX, 0, &index);
    sources.push_back({reinterpret_cast<const char*>(file), index & 0xFFFF});
  }
  if (set != nullptr) FcFontSetDestroy(set);
  FcPatternDestroy(pattern);
  return sources;
}

}  // namespace

struct Fonts::Parts {
  FT_Library library = nullptr;
  std::array<std::vector<Source>, 2> sources;  // by Weight
  std::map<std::tuple<std::uint32_t, std::uint32_t, char32_t>, Glyph> glyphs;

  ~Parts() {
    for (std::vector<Source>& list : sources)
      for (Source& source : list)
        if (source.face != nullptr) FT_Done_Face(source.face);
    if (library != nullptr) FT_Done_FreeType(library);
  }

  // Opens a font; false if that fails, or if the font has no outlines.
  bool open(Source& source) const {
    if (source.face != nullptr) return true;
    if (source.failed) return false;
    if (FT_New_Face(library, source.file.c_str(), source.index, &source.face) != 0) source.face = nullptr;
    if (source.face != nullptr && !FT_IS_SCALABLE(source.face)) {
      FT_Done_Face(source.face);
      source.face = nullptr;
    }
    source.failed = source.face == nullptr;
    return !source.failed;
  }

  FT_Face first(Weight weight) {
    for (Source& source : sources[static_cast<std::size_t>(weight)])
      if (open(source)) return source.face;
    return nullptr;
  }

  FT_Face faceWith(char32_t character, Weight weight) {
    for (Source& source : sources[static_cast<std::size_t>(weight)])
      if (open(source) && FT_Get_Char_Index(source.face, character) != 0) return source.face;
    return first(weight);
  }
};

Fonts::Fonts(const std::string& fontFile) : parts_(std::make_unique<Parts>()) {
  if (FT_Init_FreeType(&parts_->library) != 0) throw std::runtime_error("FreeType cannot be started");
  for (const Weight weight : {Weight::kRegular, Weight::kBold}) {
    std::vector<Source>& sources = parts_->sources[static_cast<std::size_t>(weight)];
    if (fontFile.empty())
      sources = systemFonts(weight);
    else
      sources.push_back({fontFile, 0});
    if (parts_->first(weight) == nullptr)
      throw std::runtime_error(
          fontFile.empty()
              ? "no font was found for texts: install one, for example Debian's fonts-dejavu-core"
              : fmt::format("the font file {} cannot be read: name a TrueType or OpenType font", fontFile));
  }
}

Fonts::~Fonts() = default;

const Glyph& Fonts::glyph(char32_t character, std::uint32_t pixels, Weight weight) {
  if (parts_->glyphs.size() >= kMostGlyphs) parts_->glyphs.clear();
  const auto [at, isNew] =
      parts_->glyphs.try_emplace({static_cast<std::uint32_t>(weight), pixels, character});
  Glyph& glyph = at->second;
  if (!isNew) return glyph;
  FT_Face face = parts_->faceWith(character, weight);
  if (FT_Set_Pixel_Sizes(face, 0, pixels) != 0 ||
      FT_Load_Char(face, character, FT_LOAD_RENDER | FT_LOAD_TARGET_LIGHT) != 0)
    return glyph;  // a damaged font: nothing is drawn for this character
  const FT_GlyphSlot slot = face->glyph;
  const FT_Bitmap& bitmap = slot->bitmap;
  glyph.advance = static_cast<float>(slot->linearHoriAdvance) / 65536.0F;
  glyph.left = slot->bitmap_left;
  glyph.top = slot->bitmap_top;
  if (bitmap.pixel_mode != FT_PIXEL_MODE_GRAY) return glyph;
  glyph.width = bitmap.width;
  glyph.height = bitmap.rows;
  glyph.coverage.reserve(std::size_t{bitmap.width} * bitmap.rows);
  for (std::uint32_t row = 0; row < bitmap.rows; ++row) {
    const std::uint8_t* line = bitmap.buffer + static_cast<std::ptrdiff_t>(row) * bitmap.pitch;
    glyph.coverage.insert(glyph.coverage.end(), line, line + bitmap.width);
  }
  return glyph;
}

float Fonts::capHeight(std::uint32_t pixels, Weight weight) {
  return static_cast<float>(glyph(U'H', pixels, weight).top);
}

char32_t nextCharacter(std::string_view& utf8) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(utf8[i]); };
  const std::uint8_t first = byte(0);
  const std::size_t length = first < 0x80                    ? 1
                             : first >= 0xC2 && first < 0xE0 ? 2
                             : first >= 0xE0 && first < 0xF0 ? 3
                             : first >= 0xF0 && first < 0xF5 ? 4
                                                             : 0;
  char32_t character = length <= 1 ? first : first & (0x7FU >> length);
  bool isValid = length > 0 && utf8.size() >= length;
  for (std::size_t i = 1; isValid && i < length; ++i) {
    isValid = (byte(i) & 0xC0U) == 0x80;
    character = (character << 6) | (byte(i) & 0x3FU);
  }
  const bool isSurrogate = character >= 0xD800 && character < 0xE000;
  const bool isOverlong = (length == 3 && character < 0x800) || (length == 4 && character < 0x10000);
  if (!isValid || isSurrogate || isOverlong || character > 0x10FFFF) {
    utf8.remove_prefix(1);
    return kReplacement;
  }
  utf8.remove_prefix(length);
  return character;
}

}  // namespace clothstream::xr
