// SPDX-License-Identifier: MIT
// Standard output and standard error of the commands. Names and texts of servers, files and other
// participants could control a terminal or imitate other text, so commands print only through this file.
#pragma once

#include <cstdio>
#include <string>
#include <string_view>
#include <type_traits>

#include <fmt/format.h>

#include "proto/text/printable.h"

namespace clothstream::cli {

// Writes lines. What could control a terminal is escaped (printable.h), except the ends of lines. Throws
// std::system_error if they cannot be written, as do all functions here.
inline void put(std::FILE* stream, std::string_view lines) {
  fmt::print(stream, "{}", printableLines(lines));
}
inline void put(std::string_view lines) {
  put(stdout, lines);
}

// Replaces the last line on a terminal. An empty line removes it.
inline void showStatus(std::FILE* stream, std::string_view line) {
  fmt::print(stream, "\r\033[K{}", printable(line));
  std::fflush(stream);
}

template <typename Argument>
decltype(auto) shown(const Argument& argument) {
  if constexpr (std::is_convertible_v<const Argument&, std::string_view>)
    return printable(std::string_view(argument));
  else
    return (argument);
}

// As fmt::format, but no text among the arguments can control a terminal or end the line.
template <typename... Arguments>
std::string formatLine(fmt::format_string<Arguments...> text, const Arguments&... arguments) {
  return [&](const auto&... safe) {
    return fmt::vformat(text, fmt::make_format_args(safe...));
  }(shown(arguments)...);
}

template <typename... Arguments>
void print(std::FILE* stream, fmt::format_string<Arguments...> text, const Arguments&... arguments) {
  put(stream, formatLine<Arguments...>(text, arguments...));
}
template <typename... Arguments>
void print(fmt::format_string<Arguments...> text, const Arguments&... arguments) {
  put(stdout, formatLine<Arguments...>(text, arguments...));
}

}  // namespace clothstream::cli
