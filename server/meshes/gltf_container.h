// SPDX-License-Identifier: MIT
// The JSON of .gltf and .glb files, before tinygltf reads it.
#pragma once

#include <optional>
#include <string>

#include <tl/expected.hpp>

namespace clothstream::meshes {

// Says that a file needs glTF 1.0 or meshopt compression, which are not supported, and what to do. Returns
// nothing if it cannot be read for another reason. `bytes` is the whole file; `binary` means .glb.
std::optional<std::string> unsupportedGltf(const std::string& bytes, bool binary);

// The bytes of a file with compressed primitives as tinygltf accepts them: it refuses accessors of indices
// without a buffer view, so these get the one with the compressed data. Files without such primitives are
// returned unchanged.
[[nodiscard]] tl::expected<std::string, std::string> prepareGltf(std::string bytes, bool binary);

}  // namespace clothstream::meshes
