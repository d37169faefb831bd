// SPDX-License-Identifier: MIT
// Text that `clothstream` prints about a stream.
#include "clients/cli/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::cli {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ReportOfClient, ShowsControlCharactersOfTheServerAsText) {
  Report report;
  report.scene = report.server = report.device = "a\x1b[2J";
  report.cloths.push_back({.name = "b\x9b", .solver = "xpbd"});
  const std::string text = report.text(false);
  EXPECT_THAT(text, HasSubstr("a\\x1b[2J of a\\x1b[2J on a\\x1b[2J"));
  EXPECT_THAT(text, HasSubstr("b\\x9b (xpbd)"));
  EXPECT_THAT(text, Not(HasSubstr("\x1b")));
}

}  // namespace
}  // namespace clothstream::cli
