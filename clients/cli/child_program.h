// SPDX-License-Identifier: MIT
// Runs another program and reads what it prints.
#pragma once

#include <string>
#include <vector>

#include <tl/expected.hpp>

namespace clothstream::cli {

struct ChildOutput {
  int exitCode = 0;  // 128 plus the number of the signal if one ended it
  std::string text;  // standard output
};

// Waits for the end of the program. Its standard error is that of this program. A name without '/' is
// searched in PATH. Output of more than 64 MiB is an error.
[[nodiscard]] tl::expected<ChildOutput, std::string> runProgram(const std::vector<std::string>& command);

}  // namespace clothstream::cli
