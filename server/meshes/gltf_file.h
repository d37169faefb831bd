// SPDX-License-Identifier: MIT
// glTF 2.0, as text or binary.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// mesh_file.h says what of it.
[[nodiscard]] tl::expected<MeshSource, std::string> readGltf(const std::filesystem::path& path, bool binary);

}  // namespace clothstream::meshes
