// SPDX-License-Identifier: MIT
// Messages about surfaces of the real rooms of all participants: reads the list and parts of meshes, and
// writes requests for parts.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/wire/wire.h"

namespace clothstream::client {

// Surfaces of a scene, at most, and the vertices and triangles of all of them together. Further ones are left
// out.
inline constexpr std::size_t kMaxRoomSurfaces = 128;
inline constexpr std::size_t kMaxRoomVertices = 300'000;
inline constexpr std::size_t kMaxRoomTriangles = 100'000;

struct RoomSurfaceEntry {
  std::uint64_t participant = 0;
  std::uint32_t id = 0;
  std::uint64_t revision = 0;
  std::array<float, 3> position{};
  std::array<float, 4> orientation{};  // x y z w; all zero means no rotation
  bool twoSided = false;
  std::uint32_t vertices = 0, triangles = 0, parts = 0;
};

std::optional<std::vector<RoomSurfaceEntry>> readRoomSurfaces(Bytes message);

// Mesh whose parts arrive.
struct RoomMesh {
  std::vector<float> positions;          // x, y, z for each vertex
  std::vector<std::uint32_t> triangles;  // three vertices for each triangle
};

// Appends what a GetSurfacePartResponse has. Returns false if it is malformed, or if the mesh would exceed
// what `entry` says.
[[nodiscard]] bool appendSurfacePart(Bytes message, const RoomSurfaceEntry& entry, RoomMesh& mesh);

// Replaces the content of `out`, and reuses its memory.
void writeSurfacePartRequest(std::string& out, std::uint64_t requestId, const RoomSurfaceEntry& entry,
                             std::uint32_t index);

}  // namespace clothstream::client
