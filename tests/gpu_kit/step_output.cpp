// SPDX-License-Identifier: MIT
#include "tests/gpu_kit/step_output.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace clothstream::gpu_kit {
namespace {

// Name of a test with this result, in a line such as "[       OK ] Suite.Name (12 ms)". Empty for other
// lines, such as those of the summary, which have no time.
std::string_view testWith(std::string_view result, std::string_view line) {
  if (!line.starts_with(result) || !line.ends_with(" ms)")) return {};
  line.remove_prefix(result.size());
  return line.substr(0, line.find_first_of(" ,"));
}

}  // namespace

void readStep(const std::filesystem::path& path, StepOutput& output) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error(fmt::format("{} cannot be read", path.string()));
  for (std::string text; std::getline(file, text);) {
    std::string_view line = text;
    if (!testWith("[       OK ] ", line).empty()) ++output.passed;
    if (!testWith("[  SKIPPED ] ", line).empty()) ++output.skipped;
    if (const auto name = testWith("[  FAILED  ] ", line); !name.empty()) output.failed.emplace_back(name);
    line.remove_prefix(std::min(line.find_first_not_of(' '), line.size()));
    if (line.ends_with(',')) line.remove_suffix(1);
    if (!line.starts_with('{')) continue;
    Row row = Row::parse(line, nullptr, false);
    if (row.is_object() && row.contains("suite")) output.rows.push_back(std::move(row));
  }
}

}  // namespace clothstream::gpu_kit
