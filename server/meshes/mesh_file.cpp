// SPDX-License-Identifier: MIT
// Selects the reader of a mesh file by its extension.
#include "server/meshes/mesh_file.h"

#include <algorithm>
#include <cctype>
#include <utility>

#include <fmt/format.h>

#include "server/files/regular_file.h"
#include "server/meshes/gltf_file.h"

namespace clothstream::meshes {
namespace {

std::string ending(const std::filesystem::path& path) {
  std::string text = path.extension().string();
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

tl::expected<MeshSource, std::string> read(const std::filesystem::path& path, const FileLimits& limits,
                                           const JointRequest* joints) {
  auto content = files::readRegularFile(path, limits.bytes);
  if (!content) return tl::unexpected(std::move(content.error().text));
  const std::string kindOfFile = ending(path);
  if (kindOfFile != ".obj" && kindOfFile != ".gltf" && kindOfFile != ".glb")
    return tl::unexpected(
        std::string("has an unknown extension; must be .obj, .gltf or .glb: export it as one of these"));
  if (kindOfFile == ".obj" && joints && !joints->animation.empty()) return tl::unexpected(noJointsError());
  if (kindOfFile == ".obj") return parseObj(*content);
  return readGltf(std::move(*content), path.parent_path(), kindOfFile == ".glb", limits, joints);
}

}  // namespace

tl::expected<MeshSource, std::string> readMeshFile(const std::filesystem::path& path,
                                                   const FileLimits& limits, const JointRequest* joints) {
  return read(path, limits, joints).map_error([&](const std::string& text) {
    return fmt::format("{}: {}", path.string(), text);
  });
}

}  // namespace clothstream::meshes
