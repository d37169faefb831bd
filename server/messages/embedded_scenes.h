// SPDX-License-Identifier: MIT
// The files of server/scenes/ as they were when the program was built.
#pragma once

#include <span>
#include <string_view>

namespace clothstream::messages {

struct EmbeddedScene {
  std::string_view name;
  std::string_view json;
};

// In the order of their names.
std::span<const EmbeddedScene> embeddedScenes();

}  // namespace clothstream::messages
