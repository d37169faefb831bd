// SPDX-License-Identifier: MIT
// The table of docs/limits.md agrees with the program.
#include <algorithm>
#include <fstream>
#include <iterator>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "server/telemetry/refusal.h"
#include "tests/e2e/process.h"

namespace clothstream::tests {
namespace {

using e2e::Process;

std::string fileContent(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

// Cells of each row of the first table, without its heading.
std::vector<std::vector<std::string>> rowsOf(const std::string& page) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream in(page);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() && !rows.empty()) break;
    if (!line.starts_with("| ") || line.starts_with("| limit ")) continue;
    std::vector<std::string> cells;
    std::istringstream row(line.substr(1));
    for (std::string cell; std::getline(row, cell, '|');) cells.push_back(cell);
    rows.push_back(cells);
  }
  return rows;
}

// The parts of a cell that are code.
std::vector<std::string> codesOf(const std::string& cell) {
  std::vector<std::string> codes;
  for (std::size_t begin = cell.find('`'); begin != std::string::npos;) {
    const std::size_t end = cell.find('`', begin + 1);
    if (end == std::string::npos) {
      ADD_FAILURE() << "odd number of backticks:" << cell;
      break;
    }
    codes.push_back(cell.substr(begin + 1, end - begin - 1));
    begin = cell.find('`', end + 1);
  }
  return codes;
}

// Default of an option on the page of options, such as 256. Fails the test if the option does not exist.
std::string defaultOf(const std::string& option, const std::string& options) {
  const std::size_t row = options.find("- `" + option + " ");
  if (row == std::string::npos) {
    ADD_FAILURE() << option << " is not an option of the server";
    return {};
  }
  const std::string text = options.substr(row, options.find("\n- ", row) - row);
  const std::size_t value = text.find("Default:");
  const std::size_t begin = text.find('`', value);
  std::string found = text.substr(begin + 1, text.find('`', begin + 1) - begin - 1);
  if (const std::size_t wrapped = found.find("\n  "); wrapped != std::string::npos)
    found.replace(wrapped, 3, " ");
  return found;
}

// The first number of a cell, without separators of thousands.
std::string numberIn(std::string cell) {
  std::erase(cell, ',');
  const std::size_t begin = cell.find_first_of("0123456789");
  if (begin == std::string::npos) return {};
  return cell.substr(begin, cell.find_first_not_of("0123456789.", begin) - begin);
}

// The text of a cell, without marks of code.
std::string textOf(std::string cell) {
  std::erase(cell, '`');
  const std::size_t begin = cell.find_first_not_of(' ');
  return cell.substr(begin, cell.find_last_not_of(' ') + 1 - begin);
}

TEST(LimitsPage, NamesOptionsDefaultsAndCountersOfTheProgram) {
  Process server({CLOTHSTREAM_SERVER, "--help-markdown"});
  ASSERT_EQ(server.waitForEnd(std::chrono::seconds(20)), 0);
  const std::string options = server.output(), monitoring = fileContent("docs/monitoring.md");
  std::set<std::string> counted;
  const auto rows = rowsOf(fileContent("docs/limits.md"));
  ASSERT_GE(rows.size(), 40u);
  for (const std::vector<std::string>& row : rows) {
    ASSERT_EQ(row.size(), 5u) << row.front();
    for (const std::string& option : codesOf(row[1])) {
      if (option == "--profile") continue;  // sets many limits; the page of options has their table
      const std::string value = defaultOf(option, options);
      const bool isNumber = value.find_first_not_of("0123456789.") == std::string::npos;
      EXPECT_EQ(isNumber ? numberIn(row[2]) : textOf(row[2]), value) << row.front() << option;
    }
    for (const std::string& counter : codesOf(row[4])) {
      counted.insert(counter);
      const bool isKnown =
          counter.starts_with("clothstream_")
              ? monitoring.find('`' + counter + '`') != std::string::npos
              : std::ranges::find(telemetry::kRefusalNames, counter) != telemetry::kRefusalNames.end();
      EXPECT_TRUE(isKnown) << counter;
    }
  }
  for (const std::string_view reason : telemetry::kRefusalNames)
    EXPECT_TRUE(reason == "stopping" || counted.contains(std::string(reason))) << reason << " has no row";
}

}  // namespace
}  // namespace clothstream::tests
