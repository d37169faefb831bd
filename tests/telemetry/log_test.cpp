// SPDX-License-Identifier: MIT
// Text from outside cannot control a terminal or forge lines of the log.
#include "server/telemetry/log.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
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
  EXPECT_TRUE(hasControlCharacters("cloth\xe2\x80\xa8"));   // U+2028, line separator
  EXPECT_EQ(printable("\xc2"), "\xc2");                     // truncated, not a control character
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

}  // namespace
}  // namespace clothstream::telemetry
