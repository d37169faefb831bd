// SPDX-License-Identifier: MIT
#include <numeric>
#include <stdexcept>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/xr/text/painter.h"

namespace clothstream::xr {
namespace {

using testing::ElementsAre;

std::vector<char32_t> charactersOf(std::string_view text) {
  std::vector<char32_t> characters;
  while (!text.empty()) characters.push_back(nextCharacter(text));
  return characters;
}

TEST(XrUtf8, ReadsCharactersOfAllLengths) {
  EXPECT_THAT(charactersOf("a\u00e9\u20ac\U0001F600"),
              ElementsAre(U'a', U'\u00e9', U'\u20ac', U'\U0001F600'));
}

TEST(XrUtf8, ReplacesEachMalformedByte) {
  EXPECT_THAT(charactersOf("\xff"), ElementsAre(0xFFFD));                          // no start of a character
  EXPECT_THAT(charactersOf("\xe2\x82"), ElementsAre(0xFFFD, 0xFFFD));              // cut off
  EXPECT_THAT(charactersOf("\xc0\xaf"), ElementsAre(0xFFFD, 0xFFFD));              // overlong
  EXPECT_THAT(charactersOf("\xed\xa0\x80"), ElementsAre(0xFFFD, 0xFFFD, 0xFFFD));  // half of a surrogate pair
  EXPECT_THAT(charactersOf("\xc3"
                           "a"),
              ElementsAre(0xFFFD, U'a'));
}

TEST(TextPainter, NamesAFontFileThatCannotBeRead) {
  try {
    TextPainter painter("/nonexistent.ttf");
    FAIL() << "no exception";
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("/nonexistent.ttf"));
  }
}

TEST(TextPainter, WidthsAddUp) {
  TextPainter painter;
  const float word = painter.width("cloth", 20);
  EXPECT_GT(word, 20);
  EXPECT_NEAR(painter.width("clothcloth", 20), 2 * word, 0.01f);
  EXPECT_GT(painter.width("cloth", 20, Weight::kBold), word);
}

TEST(TextPainter, CutsWhatDoesNotFit) {
  TextPainter painter;
  EXPECT_EQ(painter.fit("short", 20, 500), "short");
  const std::string cut = painter.fit("a text that is much too long", 20, 100);
  EXPECT_TRUE(cut.ends_with("\u2026"));
  EXPECT_LE(painter.width(cut, 20), 100);
  EXPECT_GT(cut.size(), 6U);
}

TEST(TextPainter, WrapsBetweenWords) {
  TextPainter painter;
  const std::string text = "The connection to the server is lost and is being opened again";
  const std::vector<std::string> lines = painter.wrap(text, 20, 200, 10);
  EXPECT_GT(lines.size(), 2U);
  std::string joined = lines[0];
  for (std::size_t i = 1; i < lines.size(); ++i) joined += ' ' + lines[i];
  EXPECT_EQ(joined, text);
  for (const std::string& line : lines) EXPECT_LE(painter.width(line, 20), 200);
  EXPECT_EQ(painter.wrap(text, 20, 200, 2).size(), 2U);
}

// Sum of the alpha of all texels.
std::uint64_t inkOf(const Picture& picture) {
  std::uint64_t sum = 0;
  for (std::size_t i = 3; i < picture.texels.size(); i += 4) sum += picture.texels[i];
  return sum;
}

TEST(TextPainter, WritesWithinThePicture) {
  TextPainter painter;
  Picture picture;
  clear(picture, 200, 40);
  painter.write(picture, "cloth", 20, 20, 24, {});
  EXPECT_GT(inkOf(picture), 10'000U);
  // Nothing is left of the start, and nothing breaks if a text leaves the picture on any side.
  for (std::size_t row = 0; row < 40; ++row)
    for (std::size_t column = 0; column < 18; ++column)
      EXPECT_EQ(picture.texels[4 * (row * 200 + column) + 3], 0);
  painter.write(picture, "cloth", 180, 2, 48, {});
  painter.write(picture, "cloth", -30, 39, 48, {});
}

TEST(TextPainter, DrawsCharactersThatNoFontHas) {
  TextPainter painter;
  Picture picture;
  clear(picture, 60, 40);
  painter.write(picture, "\U000F1234", 20, 20, 24, {});  // a private character
  EXPECT_GT(inkOf(picture), 0U);
}

TEST(TextPainter, RoundsCorners) {
  Picture picture;
  clear(picture, 40, 40);
  drawRounded(picture, 0, 0, 40, 40, 10, {10, 20, 30, 255});
  const auto texel = [&](std::size_t x, std::size_t y) { return &picture.texels[4 * (40 * y + x)]; };
  EXPECT_EQ(texel(0, 0)[3], 0);
  EXPECT_EQ(texel(20, 0)[3], 255);
  EXPECT_THAT(std::vector<int>(texel(20, 20), texel(20, 20) + 4), ElementsAre(10, 20, 30, 255));
}

TEST(TextPainter, LabelsAreAsWideAsTheirNames) {
  TextPainter painter;
  const auto brief = painter.label("Al", {255, 0, 0, 255});
  const auto longer = painter.label("Alexandra", {255, 0, 0, 255});
  const auto longest = painter.label(std::string(300, 'm'), {255, 0, 0, 255});
  EXPECT_LT(brief->width, longer->width);
  EXPECT_LE(longest->width, 640U);
  EXPECT_GT(longest->width, 600U);
  EXPECT_NE(brief->revision, longer->revision);
}

}  // namespace
}  // namespace clothstream::xr
