// SPDX-License-Identifier: MIT
// Writes messages about surfaces of the real room.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace clothstream::client {

// Surface of this participant.
struct OwnSurface {
  std::uint32_t id = 0;
  std::vector<float> positions;          // x, y, z for each vertex
  std::vector<std::uint32_t> triangles;  // three vertices for each triangle
  std::array<float, 3> position{};
  std::array<float, 4> orientation{};  // x y z w; all zero means no rotation
  bool twoSided = false;
  float friction = 1;
};

// Vertices, and triangles, of a part. A part has either, and is then smaller than a message may be.
inline constexpr std::uint32_t kSurfacePartElements = 4000;

// Number of parts of the mesh, 1 or more.
std::uint32_t surfacePartCount(const OwnSurface& surface);

// Each function replaces the content of `out` and reuses its memory.
void writeSurfacePart(std::string& out, const OwnSurface& surface, std::uint32_t index);
void writeSurfacePose(std::string& out, const OwnSurface& surface);
void writeSurfaceRemoval(std::string& out, std::uint32_t id);
// The server removes all surfaces but these, of which the first kMaxKeptSurfaces count.
void writeKeptSurfaces(std::string& out, std::span<const OwnSurface> surfaces);
inline constexpr std::size_t kMaxKeptSurfaces = 4096;

}  // namespace clothstream::client
