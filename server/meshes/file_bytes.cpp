// SPDX-License-Identifier: MIT
#include "server/meshes/file_bytes.h"

#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

namespace clothstream::meshes {

tl::expected<std::string, std::string> readBytes(const std::filesystem::path& path, std::uint64_t most) {
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind == std::filesystem::file_type::not_found)
    return tl::unexpected(std::string("there is no such file"));
  if (kind != std::filesystem::file_type::regular) return tl::unexpected(std::string("is not a file"));
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) return tl::unexpected(fmt::format("cannot be read: {}", error.message()));
  if (size > most)
    return tl::unexpected(fmt::format("has {} bytes; at most {} are allowed: simplify it", size, most));
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string bytes(size, '\0');
  if (!file || !file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    return tl::unexpected(fmt::format("cannot be read: {}", std::strerror(errno)));
  return bytes;
}

}  // namespace clothstream::meshes
