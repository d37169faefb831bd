// SPDX-License-Identifier: MIT
// A file to read whose length is known.
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

// The error names the path and why it cannot be read: pipes and directories cannot.
[[nodiscard]] tl::expected<RegularFile, std::string> openRegularFile(const std::string& path);

}  // namespace clothstream::files
