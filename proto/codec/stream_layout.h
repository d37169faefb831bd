// SPDX-License-Identifier: MIT
// Layout of a stream: everything that encoder and decoder know before its first packet.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace clothstream::codec {

enum class NormalMode : std::uint8_t { none = 0, octahedral = 1 };

// Vertices of a grid are row-major. Rows and columns are both zero for a cloth that is not a grid.
struct ClothLayout {
  std::uint32_t vertexCount = 0;
  std::uint32_t rows = 0, columns = 0;
  // Triangles of a mesh, for its normals and its coding order: three vertices of this cloth each,
  // counter-clockwise.
  std::vector<std::uint32_t> triangles = {};
  // Rest positions of a mesh, 3 floats a vertex, or empty. They show which vertices lie between others.
  // Without them the stream takes more bits.
  std::vector<float> restPositions = {};
};

// Numbers 1 and 3 are reserved (FRAME_FORMAT.md).
inline constexpr std::uint8_t kCodecHierarchical = 2;
// All codecs, the preferred one first.
inline constexpr std::array<std::uint32_t, 1> kCodecs{kCodecHierarchical};

constexpr bool isCodec(std::uint32_t id) {
  return std::find(kCodecs.begin(), kCodecs.end(), id) != kCodecs.end();
}

struct StreamLayout {
  std::uint32_t epoch = 0;
  std::uint8_t codec = kCodecHierarchical;
  // Maximum error in metres along each of three orthogonal axes, for vertices within 32 m of zero.
  // Farther out the spacing of floats is added. The axes turn with the surface, so the encoder promises a
  // distance of at most sqrt(3) maxError.
  float maxError = 0.0005f;
  NormalMode normals = NormalMode::none;
  // Number of quality levels of the stream. maxError is that of quality 0, and each further quality doubles
  // it. A stream changes its quality at a key frame.
  std::uint8_t qualities = 1;
  std::vector<ClothLayout> cloths;
  // Point to which the positions that an encoder gets and that packets hold are relative, in metres. Decoders
  // add it.
  std::array<float, 3> origin = {};

  std::uint32_t vertexCount() const {
    std::uint32_t sum = 0;
    for (const ClothLayout& cloth : cloths) sum += cloth.vertexCount;
    return sum;
  }
};

inline constexpr std::uint8_t kMaxQualities = 4;
inline constexpr std::uint32_t kMaxVertices = 1u << 26;
// Vertices that a reader of streams and files accepts unless its caller allows more.
inline constexpr std::uint32_t kDefaultMaxVertices = 1u << 20;
inline constexpr float kSmallestMaxError = 5e-6f, kLargestMaxError = 1000;
// Largest magnitude of a coordinate of an origin, m.
inline constexpr float kFarthestOrigin = 1e6f;

// True if a stream can have this layout: a known codec, at least one cloth, no empty cloth, grids of rows x
// columns vertices, triangles of existing vertices, finite rest positions, at most kMaxVertices vertices, and
// a max error and an origin within the bounds above.
inline bool isPossible(const StreamLayout& layout) {
  if (!(layout.maxError >= kSmallestMaxError && layout.maxError <= kLargestMaxError)) return false;
  if (layout.normals != NormalMode::none && layout.normals != NormalMode::octahedral) return false;
  if (!isCodec(layout.codec)) return false;
  if (layout.qualities < 1 || layout.qualities > kMaxQualities) return false;
  for (const float coordinate : layout.origin)
    if (!(std::abs(coordinate) <= kFarthestOrigin)) return false;
  std::uint64_t vertices = 0;
  for (const ClothLayout& cloth : layout.cloths) {
    const std::uint64_t nodes = std::uint64_t{cloth.rows} * cloth.columns;
    const bool noGrid = cloth.rows == 0 && cloth.columns == 0;
    if (cloth.vertexCount == 0 || (!noGrid && nodes != cloth.vertexCount)) return false;
    if (cloth.triangles.size() % 3 != 0 || (!noGrid && !cloth.triangles.empty())) return false;
    for (const std::uint32_t vertex : cloth.triangles)
      if (vertex >= cloth.vertexCount) return false;
    const std::size_t coordinates = cloth.restPositions.size();
    if (coordinates != 0 && (!noGrid || coordinates != 3 * std::size_t{cloth.vertexCount})) return false;
    for (const float coordinate : cloth.restPositions)
      if (!std::isfinite(coordinate)) return false;
    vertices += cloth.vertexCount;
    if (vertices > kMaxVertices) return false;
  }
  return vertices > 0;
}

// Max error of a quality of a stream whose finest quality has `maxError`.
constexpr float maxErrorOf(float maxError, std::uint8_t quality) {
  return maxError * static_cast<float>(1u << quality);
}
constexpr float maxErrorOf(const StreamLayout& layout, std::uint8_t quality) {
  return maxErrorOf(layout.maxError, quality);
}

}  // namespace clothstream::codec
