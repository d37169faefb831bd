// SPDX-License-Identifier: MIT
// Reads files that options name.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include <tl/expected.hpp>

namespace clothstream::files {

// Why a file was not read.
struct FileError {
  std::string text;         // rest of a sentence that begins with the path
  bool isTooLarge = false;  // only that
};

// Content of a regular file of at most `most` bytes. Refuses everything else, such as a folder, a device or a
// FIFO, at once: reading a FIFO would wait for its writer. Follows symbolic links. A disk that does not
// answer still blocks the calling thread.
[[nodiscard]] tl::expected<std::string, FileError> readRegularFile(const std::filesystem::path& path,
                                                                   std::uint64_t most);
// The same of a regular file or a FIFO, whose writers it waits for: what `--scene-file <(program)` names.
[[nodiscard]] tl::expected<std::string, FileError> readFileOrFifo(const std::filesystem::path& path,
                                                                  std::uint64_t most);

}  // namespace clothstream::files
