// SPDX-License-Identifier: MIT
// Text from outside cannot control a terminal or forge lines of the log.
#include "server/telemetry/log.h"

#include <chrono>
#include <cstdint>
#include <functional>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <spdlog/spdlog.h>

#include "proto/text/printable.h"

namespace clothstream::telemetry {
namespace {

using testing::HasSubstr;

TEST(Printable, EscapesControlCharactersAndKeepsOtherText) {
  for (const char* text :
       {"", "cloth", "\xc3\xa9t\xc3\xa9", "\xf0\x9f\xa7\xb5", "\xe2\x82\xac", "\xc2\xa0"}) {
    EXPECT_EQ(printable(text), text);
    EXPECT_FALSE(hasControlCharacters(text)) << text;
  }
  EXPECT_EQ(printable("a\x1b[2Jb\n"), "a\\x1b[2Jb\\x0a");
  EXPECT_EQ(printable(std::string("\0\x7f", 2)), "\\x00\\x7f");
  EXPECT_EQ(printable("\xc2\x9b"
                      "1m"),
            "\\xc2\\x9b1m");  // U+009B, CSI
  EXPECT_EQ(printable("\xe2\x80\xae"
                      "cba"),
            "\\xe2\\x80\\xaecba");                          // U+202E, right to left
  EXPECT_EQ(printable("\xe2\x81\xa6"), "\\xe2\\x81\\xa6");  // U+2066, isolate
  EXPECT_EQ(printable("\xd8\x9c"), "\\xd8\\x9c");           // U+061C, Arabic letter mark
  EXPECT_EQ(printable("\x9b"
                      "1m"),
            "\\x9b1m");                                  // CSI of a terminal with 8 bits
  EXPECT_EQ(printable("\xe2\x82\x9b"), "\xe2\x82\x9b");  // the same byte in U+209B
  EXPECT_TRUE(hasControlCharacters("cloth\x80"));
  EXPECT_TRUE(hasControlCharacters("cloth\xe2\x80\xa8"));  // U+2028, line separator
  EXPECT_EQ(printable("\xc2"), "\xc2");                    // truncated, not a control character
}

TEST(Printable, EscapesWhatHasNoWidth) {
  EXPECT_EQ(printable("a\xe2\x80\x8b"
                      "b"),
            "a\\xe2\\x80\\x8bb");                                    // U+200B, zero-width space
  EXPECT_EQ(printable("\xef\xbb\xbf"), "\\xef\\xbb\\xbf");           // U+FEFF, byte-order mark
  EXPECT_EQ(printable("\xc2\xad"), "\\xc2\\xad");                    // U+00AD, soft hyphen
  EXPECT_EQ(printable("\xe3\x85\xa4"), "\\xe3\\x85\\xa4");           // U+3164, filler of Hangul
  EXPECT_EQ(printable("\xf3\xa0\x81\x81"), "\\xf3\\xa0\\x81\\x81");  // U+E0041, tag
  EXPECT_EQ(printable("\xf0\x9f\xa7\xb5\xe3\x85\xa5"), "\xf0\x9f\xa7\xb5\xe3\x85\xa5");
}

TEST(Printable, KeepsTheEndsOfLines) {
  EXPECT_EQ(printableLines("a\n\x1b[2J\r\nb\n"), "a\n\\x1b[2J\\x0d\nb\n");
  EXPECT_EQ(printableLines(""), "");
}

TEST(Printable, EscapesJsonWithoutChangingItsMeaning) {
  const nlohmann::json hostile = {{"name",
                                   "a\x1b[2J\xc2\x9b"
                                   "1m\xe2\x80\xae"
                                   "b\xe2\x80\x8b\xf3\xa0\x81\x81\x7f\n\t\"\xc3\xa9\xf0\x9f\xa7\xb5"}};
  for (const int indent : {-1, 2}) {
    const std::string text = printableJson(hostile.dump(indent));
    EXPECT_EQ(nlohmann::json::parse(text), hostile);
    EXPECT_EQ(printableLines(text), text) << "nothing is left to escape";
    EXPECT_THAT(text, HasSubstr("\\u009b1m\\u202eb\\u200b\\udb40\\udc41\\u007f"));
    EXPECT_THAT(text, HasSubstr("\xc3\xa9\xf0\x9f\xa7\xb5"));
  }
}

TEST(Log, WritesOneLineForAMessageFromOutside) {
  setUpLog("info");
  testing::internal::CaptureStderr();
  spdlog::info("{} joined", "eve\n12:00:00.000 error the disk is full\x1b[2J");
  spdlog::default_logger()->flush();
  const std::string written = testing::internal::GetCapturedStderr();
  EXPECT_THAT(written, HasSubstr("info eve\\x0a12:00:00.000 error the disk is full\\x1b[2J joined\n"));
  EXPECT_EQ(written.find('\n'), written.size() - 1);
}

std::string written(LogFormat format, const std::function<void()>& write) {
  setUpLog("info", format);
  testing::internal::CaptureStderr();
  write();
  spdlog::default_logger()->flush();
  std::string text = testing::internal::GetCapturedStderr();
  setUpLog("info");
  return text;
}

TEST(Log, BeginsATextLineWithTheSceneThatItIsAbout) {
  const std::string text = written(LogFormat::text, [] {
    log({"flag", 3}, spdlog::level::info, "{} joined", "eve");
    log({"flag"}, spdlog::level::debug, "not shown");
    spdlog::info("about no scene");
  });
  EXPECT_THAT(text, HasSubstr(" info flag: eve joined\n"));
  EXPECT_THAT(text, HasSubstr(" info about no scene\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("not shown")));
}

TEST(Log, LimitsLinesOfEachLevelAndSaysHowManyWereLeftOut) {
  setUpLog("info", LogFormat::text, 3);
  const std::uint64_t before = omittedLogLines();
  testing::internal::CaptureStderr();
  const spdlog::log_clock::time_point second{std::chrono::hours(1)};
  const auto log = [&](std::chrono::milliseconds at, spdlog::level::level_enum level,
                       const std::string& text) {
    spdlog::default_logger()->log(second + at, {}, level, text);
  };
  using std::chrono::milliseconds;
  for (int i = 0; i < 10; ++i) log(milliseconds(i), spdlog::level::info, "flood " + std::to_string(i));
  log(milliseconds(20), spdlog::level::warn, "a warning");
  log(milliseconds(1000), spdlog::level::info, "later");
  log(milliseconds(1001), spdlog::level::info, "and again");
  spdlog::default_logger()->flush();
  const std::string text = testing::internal::GetCapturedStderr();
  setUpLog("info");
  EXPECT_THAT(text, HasSubstr("flood 2\n"));
  EXPECT_THAT(text, testing::Not(HasSubstr("flood 3")));
  EXPECT_THAT(text, HasSubstr("a warning\n")) << "a flood of one level hides no other";
  EXPECT_THAT(text, testing::ContainsRegex("7 lines were left out here \\(--profile\\)\n.*info later\n"));
  EXPECT_THAT(text, HasSubstr("and again\n"));
  EXPECT_EQ(omittedLogLines() - before, 7u);
}

TEST(Log, WritesOneJsonObjectForEachMessage) {
  const std::string text = written(LogFormat::json, [] {
    log({"fl\"ag\\", 3}, spdlog::level::warn, "{} joined", "eve\n{\"level\":\"error\"}\x1b[2J\xc2\x9b");
    spdlog::info("invalid \xff UTF-8 and {}", "\xf0\x9f\xa7\xb5");
    log({"flag"}, spdlog::level::debug, "not shown");
  });
  for (const char c : text) EXPECT_TRUE(c == '\n' || (c >= 0x20 && c < 0x7f)) << text;
  std::istringstream lines(text);
  std::vector<nlohmann::json> objects;
  for (std::string line; std::getline(lines, line);) objects.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(objects.size(), 2u);
  EXPECT_THAT(objects[0]["time"].get<std::string>(),
              testing::MatchesRegex("20..-..-..T..:..:..[.][0-9][0-9][0-9]Z"));
  EXPECT_EQ(objects[0]["level"], "warning");
  EXPECT_EQ(objects[0]["message"], "eve\\x0a{\"level\":\"error\"}\\x1b[2J\\xc2\\x9b joined");
  EXPECT_EQ(objects[0]["scene"], "fl\"ag\\");
  EXPECT_EQ(objects[0]["participant"], 3);
  EXPECT_EQ(objects[1]["message"], "invalid \ufffd UTF-8 and \xf0\x9f\xa7\xb5");
  EXPECT_FALSE(objects[1].contains("scene"));
  EXPECT_FALSE(objects[1].contains("participant"));
}

}  // namespace
}  // namespace clothstream::telemetry
