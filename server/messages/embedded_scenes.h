// SPDX-License-Identifier: MIT
// Scene files of server/scenes/, embedded when the program is built.
#pragma once

#include <span>
#include <string_view>

namespace clothstream::messages {

struct EmbeddedScene {
  std::string_view name;
  std::string_view json;
};

// Sorted by name.
std::span<const EmbeddedScene> embeddedScenes();

// OBJ file that an embedded scene refers to.
struct EmbeddedMesh {
  std::string_view file;
  std::string_view obj;
};
std::span<const EmbeddedMesh> embeddedMeshes();

}  // namespace clothstream::messages
