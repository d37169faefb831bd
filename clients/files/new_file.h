// SPDX-License-Identifier: MIT
// Writes a file that exists either completely or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream::files {

// Writes to a temporary file next to the path and renames it at the end. So readers of the path see either
// the old or the complete new file. Errors name the path and the system's reason.
class NewFile {
 public:
  // The path may name an existing file, which stays until finish(), but not a directory or device.
  [[nodiscard]] static tl::expected<NewFile, std::string> create(const std::string& path);
  // Removes the temporary file unless finish() was called.
  ~NewFile();
  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&&) = delete;

  [[nodiscard]] tl::expected<void, std::string> write(std::span<const std::byte> bytes);
  [[nodiscard]] tl::expected<void, std::string> write(std::string_view text) {
    return write(std::as_bytes(std::span(text)));
  }
  // Moves the file to its path. Must be the last call.
  [[nodiscard]] tl::expected<void, std::string> finish();

  std::uint64_t bytes() const { return bytes_; }

 private:
  NewFile(std::string path, std::string temporary, int file)
      : path_(std::move(path)), temporary_(std::move(temporary)), file_(file) {}

  std::string path_, temporary_;
  int file_ = -1;  // -1 after finish() or a move
  std::uint64_t bytes_ = 0;
};

}  // namespace clothstream::files
