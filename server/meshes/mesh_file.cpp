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

tl::expected<MeshSource, std::string> readObj(const std::filesystem::path& path, std::uint64_t bytes) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  std::string text(bytes, '\0');
  if (!file || !file.read(text.data(), static_cast<std::streamsize>(text.size())))
    return tl::unexpected(fmt::format("cannot be read: {}", std::strerror(errno)));
  return parseObj(text);
}

tl::expected<MeshSource, std::string> read(const std::filesystem::path& path, std::uint64_t maxBytes) {
  std::error_code error;
  const auto kind = std::filesystem::status(path, error).type();
  if (kind == std::filesystem::file_type::not_found)
    return tl::unexpected(std::string("there is no such file"));
  if (kind != std::filesystem::file_type::regular) return tl::unexpected(std::string("is not a file"));
  const std::uint64_t bytes = std::filesystem::file_size(path, error);
  if (error) return tl::unexpected(fmt::format("cannot be read: {}", error.message()));
  if (bytes > maxBytes)
    return tl::unexpected(fmt::format("has {} bytes; at most {} are allowed: simplify it", bytes, maxBytes));
  const std::string kindOfFile = ending(path);
  if (kindOfFile == ".obj") return readObj(path, bytes);
  if (kindOfFile == ".gltf" || kindOfFile == ".glb") return readGltf(path, kindOfFile == ".glb");
  return tl::unexpected(
      std::string("has an unknown extension; must be .obj, .gltf or .glb: export it as one of these"));
}

}  // namespace

tl::expected<MeshSource, std::string> readMeshFile(const std::filesystem::path& path,
                                                   std::uint64_t maxBytes) {
  return read(path, maxBytes).map_error([&](const std::string& text) {
    return fmt::format("{}: {}", path.string(), text);
  });
}

}  // namespace clothstream::meshes
