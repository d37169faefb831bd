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

// An OBJ file that one of them names.
struct EmbeddedMesh {
  std::string_view file;
  std::string_view obj;
};
std::span<const EmbeddedMesh> embeddedMeshes();

}  // namespace clothstream::messages
