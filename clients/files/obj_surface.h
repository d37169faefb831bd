// SPDX-License-Identifier: MIT
// Reads the vertices and triangles of a Wavefront OBJ file in the order of the file.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <tl/expected.hpp>

namespace clothstream::files {

struct ObjSurface {
  std::vector<float> positions;  // 3 per vertex, as in the file
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Vertices are neither merged nor reordered, so that arrays of other programs fit to them. A face with more
// corners becomes a fan of triangles. Statements other than v and f are ignored. The error names the path
// and the line.
[[nodiscard]] tl::expected<ObjSurface, std::string> readObjSurface(const std::string& path);

}  // namespace clothstream::files
