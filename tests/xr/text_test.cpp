// SPDX-License-Identifier: MIT
#include <numeric>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clients/xr/text/fixed_text.h"
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
  EXPECT_EQ(painter.fit("short", 20, 500).text, "short");
  EXPECT_FALSE(painter.fit("short", 20, painter.width("short", 20)).isCut);
  const std::string_view text = "a text that is much too long";
  const TextPainter::Fitted cut = painter.fit(text, 20, 100);
  EXPECT_TRUE(cut.isCut);
  EXPECT_TRUE(text.starts_with(cut.text));
  EXPECT_GT(cut.text.size(), 3U);
  EXPECT_LE(cut.width, 100);
  EXPECT_NEAR(cut.width, painter.width(std::string(cut.text) + "\u2026", 20), 0.01f);
}

std::vector<std::string_view> wrapped(TextPainter& painter, std::string_view text, std::size_t lines) {
  std::vector<std::string_view> out;
  painter.wrap(text, 20, 200, lines, out);
  return out;
}

TEST(TextPainter, WrapsBetweenWords) {
  TextPainter painter;
  const std::string text = "The connection to the server is lost and is being opened again";
  const std::vector<std::string_view> lines = wrapped(painter, text, 10);
  EXPECT_GT(lines.size(), 2U);
  std::string joined(lines[0]);
  for (std::size_t i = 1; i < lines.size(); ++i) joined.append(" ").append(lines[i]);
  EXPECT_EQ(joined, text);
  for (const std::string_view line : lines) EXPECT_LE(painter.width(line, 20), 200);
  // The last line has the rest, which is cut when it is drawn.
  const std::vector<std::string_view> two = wrapped(painter, text, 2);
  EXPECT_THAT(two, ElementsAre(lines[0], std::string_view(text).substr(lines[0].size() + 1)));
  EXPECT_THAT(wrapped(painter, "", 3), ElementsAre(""));
  EXPECT_THAT(wrapped(painter, std::string(60, 'w') + " a", 3), ElementsAre(std::string(60, 'w'), "a"));
}

TEST(TextPainter, DrawsNothingRightOfTheRoomOfAText) {
  TextPainter painter;
  Picture picture;
  clear(picture, 300, 40);
  painter.write(picture, "a text that is much too long", 20, 20, 20, {}, Align::kLeft, Weight::kRegular, 100);
  for (std::size_t row = 0; row < 40; ++row)
    for (std::size_t column = 122; column < 300; ++column)  // glyphs reach over their advance by a texel
      ASSERT_EQ(picture.texels[4 * (row * 300 + column) + 3], 0) << column;
}

TEST(XrFixedText, CutsAfterAWholeCharacter) {
  EXPECT_EQ(FixedText("Ada").view(), "Ada");
  const std::string most(FixedText::kMost, 'a');
  EXPECT_EQ(FixedText(most).view(), most);
  EXPECT_EQ(FixedText(most + "b").view(), most);
  // The last character of three bytes does not fit.
  const std::string before(FixedText::kMost - 2, 'a');
  EXPECT_EQ(FixedText(before + "\u20ac").view(), before);
  EXPECT_EQ(FixedText::format("{}{}", before, "\u20ac").view(), before);
  EXPECT_EQ(FixedText::format("{:.1f} ms", 2.25).view(), "2.2 ms");
}

Picture sample(std::uint32_t width, std::uint32_t height) {
  Picture picture;
  clear(picture, width, height);
  touch(picture);
  return picture;
}

TEST(PictureChanges, AreRectanglesAroundWhatDiffers) {
  const Picture before = sample(50, 40);
  Picture after = before;
  drawRounded(after, 5, 3, 10, 2, 0, {});     // rows 3 and 4
  drawRounded(after, 20, 18, 30, 22, 0, {});  // rows 18 to 39
  touch(after);
  findChanges(before, after);
  EXPECT_EQ(after.since, before.revision);
  EXPECT_THAT(after.changes,
              ElementsAre(TexelRect{5, 0, 15, 16}, TexelRect{20, 16, 50, 32}, TexelRect{20, 32, 50, 40}));
}

TEST(PictureChanges, AreNoneOfAnEqualPicture) {
  const Picture before = sample(50, 40);
  Picture after = before;
  touch(after);
  findChanges(before, after);
  EXPECT_EQ(after.since, before.revision);
  EXPECT_TRUE(after.changes.empty());
}

TEST(PictureChanges, AreEverythingWithoutAPictureOfTheSameSize) {
  Picture after = sample(50, 40);
  findChanges(Picture(), after);
  EXPECT_EQ(after.since, 0U);
  findChanges(sample(50, 41), after);
  EXPECT_EQ(after.since, 0U);
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
