// SPDX-License-Identifier: MIT
// Opens a regular file for reading.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>

#include <tl/expected.hpp>

namespace clothstream::files {

struct RegularFile {
  std::ifstream stream;
  std::uint64_t bytes = 0;
};

// The error names the path and the reason. Pipes and directories are errors.
[[nodiscard]] tl::expected<RegularFile, std::string> openRegularFile(const std::string& path);

}  // namespace clothstream::files
