// SPDX-License-Identifier: MIT
// Reads meshes that are compressed with Draco, as KHR_draco_mesh_compression of glTF has them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "server/model/mesh.h"

namespace clothstream::meshes {

// Most attributes of a compressed mesh, most bytes of all attributes of a point, and most of their
// components. glTF has no mesh that needs more.
inline constexpr int kMaxDracoAttributes = 16;
inline constexpr int kMaxDracoPointBytes = 256;
inline constexpr int kMaxDracoComponents = 64;

struct DracoRequest {
  std::uint32_t positions = 0;       // unique id of the attribute
  std::optional<std::uint32_t> uvs;  // likewise
  // Further attribute with one to four numbers for each point.
  struct Vector {
    std::uint32_t id = 0;
    std::size_t components = 4;
  };
  std::vector<Vector> vectors = {};
  // Most points and faces: what the file states outside of the compressed data, which the caller has checked.
  std::uint64_t maxPoints = 0, maxFaces = 0;
};

struct DracoMesh {
  std::vector<model::Vec3> positions;  // of points
  std::vector<model::Uv> uvs;          // of points; empty if not requested
  // Further attributes of the points, one for each of the request. Numbers that an attribute does not have
  // are 0.
  std::vector<std::vector<Eigen::Vector4f>> vectors;
  std::vector<std::uint32_t> indices;  // of points, three per face; they exist
};

// Decodes a buffer of version 2.2. The sizes in the buffer are read first. Larger ones than requested are
// refused before anything is allocated for them. So a buffer costs memory and time in proportion to its own
// bytes and to the requested points and faces. The error says what is wrong.
[[nodiscard]] tl::expected<DracoMesh, std::string> decodeDraco(std::span<const std::byte> bytes,
                                                               const DracoRequest& request);

}  // namespace clothstream::meshes
