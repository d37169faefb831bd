// SPDX-License-Identifier: MIT
// Reads glTF 2.0 files.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

#include "server/meshes/mesh_file.h"
#include "server/meshes/mesh_source.h"

namespace clothstream::meshes {

// Reads the bytes of a .gltf file, or of a .glb file if `binary`. It may refer to files in `folder` and
// below. All files together are within the limit of bytes. mesh_file.h describes the result.
[[nodiscard]] tl::expected<MeshSource, std::string> readGltf(std::string bytes,
                                                             const std::filesystem::path& folder, bool binary,
                                                             const FileLimits& limits,
                                                             const JointRequest* joints);

// Says that an animation was named, but the file has no joints.
std::string noJointsError();

}  // namespace clothstream::meshes
