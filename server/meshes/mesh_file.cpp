// SPDX-License-Identifier: MIT
// Selects the reader of a mesh file by its extension.
#include "server/meshes/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>

#include <fmt/format.h>

#include "server/meshes/gltf_file.h"

namespace clothstream::meshes {
namespace {

std::string ending(const std::filesystem::path& path) {
  std::string text = path.extension().string();
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

tl::expected<std::string, std::string> bytesOf(const std::filesystem::path& path, std::uint64_t size) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string bytes(size, '\0');
  if (!file || !file.read(bytes.data(), static_cast<std::streamsize>(bytes.size())))
    return tl::unexpected(fmt::format("cannot be read: {}", std::strerror(errno)));
  return bytes;
}

tl::expected<MeshSource, std::string> read(const std::filesystem::path& path, const FileLimits& limits) {
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind == std::filesystem::file_type::not_found)
    return tl::unexpected(std::string("there is no such file"));
  if (kind != std::filesystem::file_type::regular) return tl::unexpected(std::string("is not a file"));
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  if (error) return tl::unexpected(fmt::format("cannot be read: {}", error.message()));
  if (bytes > limits.bytes)
    return tl::unexpected(
        fmt::format("has {} bytes; at most {} are allowed: simplify it", bytes, limits.bytes));
  const std::string kindOfFile = ending(path);
  if (kindOfFile != ".obj" && kindOfFile != ".gltf" && kindOfFile != ".glb")
    return tl::unexpected(
        std::string("has an unknown extension; must be .obj, .gltf or .glb: export it as one of these"));
  auto content = bytesOf(path, bytes);
  if (!content) return tl::unexpected(std::move(content.error()));
  if (kindOfFile == ".obj") return parseObj(*content);
  return readGltf(std::move(*content), path.parent_path(), kindOfFile == ".glb", limits.vertices);
}

}  // namespace

tl::expected<MeshSource, std::string> readMeshFile(const std::filesystem::path& path,
                                                   const FileLimits& limits) {
  return read(path, limits).map_error([&](const std::string& text) {
    return fmt::format("{}: {}", path.string(), text);
  });
}

}  // namespace clothstream::meshes
