// SPDX-License-Identifier: MIT
// File of a recording while it is written.
#pragma once

#include <string>
#include <string_view>

#include <tl/expected.hpp>

namespace clothstream::recording {

// The file has its final path from the start, so written data survives any end of the program. Errors name
// the path and the system's message.
class OutputFile {
 public:
  // Fails if the path exists.
  [[nodiscard]] static tl::expected<OutputFile, std::string> create(const std::string& path);
  ~OutputFile();
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&&) = delete;

  // The operating system has the bytes when the call returns.
  [[nodiscard]] tl::expected<void, std::string> write(std::string_view bytes);
  // The disk has the bytes when the call returns.
  [[nodiscard]] tl::expected<void, std::string> sync();

 private:
  OutputFile(std::string path, int file) : path_(std::move(path)), file_(file) {}

  std::string path_;
  int file_ = -1;  // -1 after a move to another OutputFile
};

}  // namespace clothstream::recording
