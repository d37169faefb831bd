// SPDX-License-Identifier: MIT
// A recording's file while it is written.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream::recording {

// In its place from the start: what was written to it stays, however the program ends. Errors name the path
// and what the system said of it.
class OutputFile {
 public:
  // There must be nothing of this path yet.
  [[nodiscard]] static tl::expected<OutputFile, std::string> create(const std::string& path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  // With the operating system when it returns.
  [[nodiscard]] tl::expected<void, std::string> write(std::string_view bytes);
  // On the disk.
  [[nodiscard]] tl::expected<void, std::string> sync();

 private:
  OutputFile(std::string path, int file) : path_(std::move(path)), file_(file) {}

  std::string path_;
  int file_ = -1;  // -1: moved to another OutputFile
};

}  // namespace clothstream::recording
