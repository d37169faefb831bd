// SPDX-License-Identifier: MIT
// Reads glTF 2.0 files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// Reads the bytes of a .gltf file, or of a .glb file if `binary`. Buffers in other files are in `folder`.
// mesh_file.h describes the result.
[[nodiscard]] tl::expected<MeshSource, std::string> readGltf(std::string bytes,
                                                             const std::filesystem::path& folder, bool binary,
                                                             std::uint64_t maxVertices);

}  // namespace clothstream::meshes
