// SPDX-License-Identifier: MIT
// A temporary directory for keys.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "server/identity/token_key.h"

namespace clothstream::tests {

class KeyDirectory {
 public:
  KeyDirectory() {
    std::string name = std::filesystem::temp_directory_path() / "clothstream_keys_XXXXXX";
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary directory");
    path_ = name;
  }
  ~KeyDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  KeyDirectory(const KeyDirectory&) = delete;
  KeyDirectory& operator=(const KeyDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::ofstream(path_ / name, std::ios::binary) << content;
    return path_ / name;
  }
  identity::TokenKey make(const std::string& name) const {
    identity::makeTokenKey(path_ / name);
    return identity::readTokenKey(path_ / name);
  }

 private:
  std::filesystem::path path_;
};

}  // namespace clothstream::tests
