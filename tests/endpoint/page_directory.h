// SPDX-License-Identifier: MIT
// Temporary page directory for tests, next to files that must not be served. Removed by the destructor.
#pragma once

#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include <stdlib.h>

namespace clothstream::tests {

class PageDirectory {
 public:
  PageDirectory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "clothstream-page-XXXXXX").string();
    if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary directory");
    parent_ = pattern;
    std::filesystem::create_directory(path());
  }
  ~PageDirectory() { std::filesystem::remove_all(parent_); }
  PageDirectory(const PageDirectory&) = delete;
  PageDirectory& operator=(const PageDirectory&) = delete;

  std::filesystem::path path() const { return parent_ / "page"; }
  void write(const std::string& name, const std::string& content) const { put(path() / name, content); }
  void writeOutside(const std::string& name, const std::string& content) const {
    put(parent_ / name, content);
  }

 private:
  static void put(const std::filesystem::path& file, const std::string& content) {
    std::filesystem::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << content;
  }

  std::filesystem::path parent_;
};

}  // namespace clothstream::tests
