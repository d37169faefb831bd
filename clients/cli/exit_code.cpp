// SPDX-License-Identifier: MIT
// Text of the exit codes.
#include "clients/cli/exit_code.h"

#include <cstddef>
#include <sstream>

#include <fmt/format.h>

namespace clothstream::cli {

std::string exitCodeHelp() {
  constexpr std::size_t kColumns = 107;
  std::string text;
  for (const ExitMeaning& meaning : kExitMeanings)
    text += fmt::format("{}{:d} {}", text.empty() ? "Exit codes: " : "; ", static_cast<int>(meaning.code),
                        meaning.text);
  std::istringstream words(text + ".");
  std::string help;
  std::size_t column = 0;
  for (std::string word; words >> word; column += word.size()) {
    const bool fits = column + 1 + word.size() <= kColumns;
    if (column > 0) help += fits ? ' ' : '\n';
    column = column > 0 && fits ? column + 1 : 0;
    help += word;
  }
  return help;
}

}  // namespace clothstream::cli
