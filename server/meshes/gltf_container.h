// SPDX-License-Identifier: MIT
// The JSON of .gltf and .glb files, before tinygltf reads it.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include <tl/expected.hpp>

namespace clothstream::meshes {

// Says that a file needs glTF 1.0 or meshopt compression, which are not supported, and what to do. Returns
// nothing if it cannot be read for another reason. `bytes` is the whole file; `binary` means .glb.
std::optional<std::string> unsupportedGltf(const std::string& bytes, bool binary);

// Whether a file that the JSON names exists and may be read.
using FileExists = std::function<bool(const std::string& name)>;

// Names the first file of a buffer that does not exist. Nothing if all exist.
std::optional<std::string> missingFile(const std::string& bytes, bool binary, const FileExists& exists);

// The bytes of a file as tinygltf accepts them. It refuses accessors of indices without a buffer view, so
// those of compressed primitives get the one with the compressed data. It reads some names of files in
// another way than URIs are defined, so these are written differently, and images, which are not needed, are
// left out. Other files are returned unchanged.
[[nodiscard]] tl::expected<std::string, std::string> prepareGltf(std::string bytes, bool binary,
                                                                 const FileExists& exists);

}  // namespace clothstream::meshes
