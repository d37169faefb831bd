// SPDX-License-Identifier: MIT
#include "server/files/state_directory.h"

#include <cerrno>
#include <cstring>
#include <system_error>

#include <fmt/format.h>
#include <sys/stat.h>

namespace clothstream::files {

tl::expected<void, std::string> makeStateDirectory(const std::filesystem::path& directory) {
  std::error_code problem;
  if (!directory.parent_path().empty()) std::filesystem::create_directories(directory.parent_path(), problem);
  if (problem) return tl::unexpected(fmt::format("cannot be created: {}", problem.message()));
  if (::mkdir(directory.c_str(), S_IRWXU) == 0) return {};
  if (errno != EEXIST) return tl::unexpected(fmt::format("cannot be created: {}", std::strerror(errno)));
  const auto kind = std::filesystem::symlink_status(directory, problem).type();
  if (kind == std::filesystem::file_type::directory) return {};
  return tl::unexpected(
      std::string(kind == std::filesystem::file_type::symlink ? kIsLink : "is not a folder; move it away"));
}

}  // namespace clothstream::files
