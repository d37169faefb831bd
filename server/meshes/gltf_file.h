// SPDX-License-Identifier: MIT
// Reads glTF 2.0 files.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// mesh_file.h describes the result. `binary` means .glb.
[[nodiscard]] tl::expected<MeshSource, std::string> readGltf(const std::filesystem::path& path, bool binary);

}  // namespace clothstream::meshes
