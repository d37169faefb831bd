// SPDX-License-Identifier: MIT
// Exit codes of `clothstream`.
#include <algorithm>
#include <chrono>
#include <fstream>
#include <regex>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/e2e/process.h"

namespace clothstream::e2e {
namespace {

using ::testing::HasSubstr;

constexpr std::chrono::seconds kPatience{20};

TEST(ExitCode, HelpAndDocumentationAgree) {
  Process program({CLOTHSTREAM, "--help"});
  ASSERT_EQ(program.waitForEnd(kPatience), 0);
  std::string help = program.output();
  std::ranges::replace(help, '\n', ' ');
  std::ifstream page("docs/command-line.md");
  ASSERT_TRUE(page) << "run the tests in the root of the repository";
  const std::regex row(R"(\| (\d+) \| (.*) \|)");
  std::smatch match;
  std::string documented = "Exit codes:";
  for (std::string line; std::getline(page, line);)
    if (std::regex_match(line, match, row))
      documented += (match[1] == "0" ? " " : "; ") + match[1].str() + " " + match[2].str();
  std::erase(documented, '`');
  EXPECT_THAT(help, HasSubstr(documented + "."));
}

TEST(ExitCode, FailureOfTheProgramDiffersFromALostStream) {
  // Its message cannot be written, which is an error that the program does not expect.
  Process program({"/bin/sh", "-c", "exec \"$0\" info /nowhere 2>/dev/full", CLOTHSTREAM});
  EXPECT_EQ(program.waitForEnd(kPatience), 8);
}

}  // namespace
}  // namespace clothstream::e2e
