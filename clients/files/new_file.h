// SPDX-License-Identifier: MIT
// A file that is there whole or not at all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream::files {

// Written beside its place and then moved there: whoever reads the path sees a whole file or the former one.
// Errors name the path and what the system said of it.
class NewFile {
 public:
  // The path may be that of a file, which stays until finish(), but not of a directory or a device.
  [[nodiscard]] static tl::expected<NewFile, std::string> create(const std::string& path);
  // What was not finished leaves nothing.
  ~NewFile();
  NewFile(NewFile&& other) noexcept;
  NewFile& operator=(NewFile&&) = delete;

  [[nodiscard]] tl::expected<void, std::string> write(std::span<const std::byte> bytes);
  [[nodiscard]] tl::expected<void, std::string> write(std::string_view text) {
    return write(std::as_bytes(std::span(text)));
  }
  // Moves it into its place. Once, and nothing after it.
  [[nodiscard]] tl::expected<void, std::string> finish();

  std::uint64_t bytes() const { return bytes_; }

 private:
  NewFile(std::string path, std::string temporary, int file)
      : path_(std::move(path)), temporary_(std::move(temporary)), file_(file) {}

  std::string path_, temporary_;
  int file_ = -1;  // -1: finished, or moved to another NewFile
  std::uint64_t bytes_ = 0;
};

}  // namespace clothstream::files
