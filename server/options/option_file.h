// SPDX-License-Identifier: MIT
// Reads and writes option files: flat TOML with one key per option.
#pragma once

#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace clothstream {

// A wrong option. The text names the source, the value, what is allowed, and what to do.
struct OptionError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct FileEntry {
  std::string key;
  std::vector<std::string> values;  // strings without quotes and escapes; numbers and booleans as written
  int line = 0;                     // line of the key, from 1
};

// Parses TOML. Values are strings, numbers, booleans, and arrays of these; tables and dates are errors.
// Throws OptionError "NAME:LINE: ...".
std::vector<FileEntry> parseOptionFile(std::string_view text, const std::string& name);

// TOML string in quotes.
std::string tomlString(std::string_view text);

}  // namespace clothstream
