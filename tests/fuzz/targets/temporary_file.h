// SPDX-License-Identifier: MIT
// Input as a file, for readers that need a path.
#pragma once

#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <string_view>

#include <unistd.h>

#include "tests/fuzz/target.h"

namespace clothstream::fuzz {

class TemporaryFile {
 public:
  // `ending` is that of the name, such as ".glb".
  TemporaryFile(std::string_view ending, std::span<const std::byte> bytes)
      : path_(std::filesystem::temp_directory_path() /
              ("clothstream-fuzz-" + std::to_string(::getpid()) + std::string(ending))) {
    std::ofstream out(path_, std::ios::binary | std::ios::trunc);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    require(out.flush().good(), "the temporary directory has room");
  }
  ~TemporaryFile() { std::filesystem::remove(path_); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace clothstream::fuzz
