// SPDX-License-Identifier: MIT
// Reads a file whose size is limited.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <tl/expected.hpp>

namespace clothstream::meshes {

// Refuses what is not a regular file, such as a folder or a device, and more than `most` bytes.
[[nodiscard]] tl::expected<std::string, std::string> readBytes(const std::filesystem::path& path,
                                                               std::uint64_t most);

}  // namespace clothstream::meshes
