// SPDX-License-Identifier: MIT
// Option files: toml++ parses them, this file checks that they are flat.
#include "server/options/option_file.h"

#include <algorithm>
#include <sstream>

#include <fmt/format.h>
#include <toml++/toml.h>

namespace clothstream {
namespace {

[[noreturn]] void fail(const std::string& name, const toml::source_region& where, std::string_view what) {
  throw OptionError(fmt::format("{}:{}: {}", name, where.begin.line, what));
}

std::string textOf(const toml::node& node, const std::string& file, std::string_view key) {
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return fmt::format("{}", number->get());
  if (const auto* number = node.as_floating_point()) return fmt::format("{}", number->get());
  if (const auto* flag = node.as_boolean()) return flag->get() ? "true" : "false";
  fail(file, node.source(),
       fmt::format("{}: use a string, a number, true, false, or an array of these", key));
}

toml::table parse(std::string_view text, const std::string& name) {
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& error) {
    fail(
        name, error.source(),
        fmt::format("{}; TOML needs one key = value on a line, and quotes around text", error.description()));
  }
}

}  // namespace

std::vector<FileEntry> parseOptionFile(std::string_view text, const std::string& name) {
  std::vector<FileEntry> entries;
  for (const auto& [key, node] : parse(text, name)) {
    if (node.is_table() || node.is_array_of_tables())
      fail(name, node.source(), "tables are not supported; write every key at the top level");
    FileEntry entry{
        .key = std::string(key.str()), .values = {}, .line = static_cast<int>(key.source().begin.line)};
    if (const auto* array = node.as_array()) {
      for (const toml::node& element : *array) entry.values.push_back(textOf(element, name, key.str()));
    } else {
      entry.values.push_back(textOf(node, name, key.str()));
    }
    entries.push_back(std::move(entry));
  }
  // The table is sorted by key. Errors are reported for the first wrong line.
  std::ranges::sort(entries, {}, &FileEntry::line);
  return entries;
}

std::string tomlString(std::string_view text) {
  std::ostringstream out;
  const toml::value<std::string> value{std::string(text)};
  out << toml::toml_formatter{value, toml::format_flags::allow_unicode_strings};
  return out.str();
}

}  // namespace clothstream
