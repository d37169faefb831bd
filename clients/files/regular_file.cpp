// SPDX-License-Identifier: MIT
#include "clients/files/regular_file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>

#include <fmt/format.h>

namespace clothstream::files {

tl::expected<RegularFile, std::string> openRegularFile(const std::string& path) {
  const auto problem = [&](const std::string& what) {
    return tl::unexpected(fmt::format("cannot read {}: {}", path, what));
  };
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (error) return problem(error.message());
  if (status.type() != std::filesystem::file_type::regular) return problem("it is not a regular file");
  RegularFile file;
  file.bytes = std::filesystem::file_size(path, error);
  if (error) return problem(error.message());
  file.stream.open(path, std::ios::binary);
  if (!file.stream) return problem(std::strerror(errno));
  return file;
}

}  // namespace clothstream::files
