// SPDX-License-Identifier: MIT
// A temporary directory for keys.
#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include "server/identity/token_key.h"
#include "tests/e2e/temporary_directory.h"

namespace clothstream::tests {

class KeyDirectory : public e2e::TemporaryDirectory {
 public:
  std::filesystem::path write(const std::string& name, const std::string& content) const {
    std::ofstream(path() / name, std::ios::binary) << content;
    return path() / name;
  }
  identity::TokenKey make(const std::string& name) const {
    identity::makeTokenKey(path() / name);
    return identity::readTokenKey(path() / name);
  }
};

}  // namespace clothstream::tests
