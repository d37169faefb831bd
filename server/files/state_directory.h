// SPDX-License-Identifier: MIT
// Folders inside of the state directory.
#pragma once

#include <filesystem>
#include <string>

#include <tl/expected.hpp>

namespace clothstream::files {

// Creates the folder with mode 0700, and those above it, if it does not exist. Refuses a symbolic link in its
// place, because writing there would leave the state directory; links above it are followed. The error is
// the rest of a sentence that begins with the path.
[[nodiscard]] tl::expected<void, std::string> makeStateDirectory(const std::filesystem::path& directory);

// Error text of a file or folder that is such a link.
inline constexpr const char* kIsLink =
    "is a symbolic link, which may lead out of the state directory; replace it by what it names";

}  // namespace clothstream::files
