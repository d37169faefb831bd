// SPDX-License-Identifier: MIT
// What encoder and decoder know of a stream before its first packet.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace clothstream::codec {

enum class NormalMode : std::uint8_t { none = 0, octahedral = 1 };

// Vertices are row-major where rows and columns are not zero.
struct ClothLayout {
  std::uint32_t vertexCount = 0;
  std::uint32_t rows = 0, columns = 0;
  // Of a cloth that is no grid, for its normals: three of the cloth's own vertices each, counter-clockwise.
  std::vector<std::uint32_t> triangles = {};
  // Of a mesh, 3 floats a vertex, or nothing: they tell which vertices lie between which others. Without them
  // it takes more bits.
  std::vector<float> restPositions = {};
};

// The same but for how residuals are written: with the fewest bits, or so that a device does it.
inline constexpr std::uint8_t kCodecHierarchical = 2, kCodecPacked = 3;
// All there are, the best first.
inline constexpr std::array<std::uint32_t, 2> kCodecs{kCodecHierarchical, kCodecPacked};

constexpr bool isCodec(std::uint32_t id) {
  return std::find(kCodecs.begin(), kCodecs.end(), id) != kCodecs.end();
}

// Frames at full, half and a quarter of the rate.
inline constexpr std::uint8_t kMaxTemporalLayers = 3;

struct StreamLayout {
  std::uint32_t epoch = 0;
  std::uint8_t codec = kCodecHierarchical;
  // m along each of three axes: the promise the encoder keeps for whatever lies within 32 m of the origin.
  // Farther out the spacing of floats there comes on top. The axes turn with the surface: what is promised is
  // the distance that follows, sqrt(3) maxError at most.
  float maxError = 0.0005f;
  NormalMode normals = NormalMode::none;
  // 1: each frame refers to the one before it, and none can be left out. 2 or 3: every second
  // frame can, or all but every fourth, layer by layer from the highest; it costs bits (docs/codec.md).
  std::uint8_t temporalLayers = 1;
  // In how many the stream can come. maxError is that of quality 0; each other has twice the max error of the
  // one before. A stream goes from one to another at a key frame.
  std::uint8_t qualities = 1;
  std::vector<ClothLayout> cloths;

  std::uint32_t vertexCount() const {
    std::uint32_t sum = 0;
    for (const ClothLayout& cloth : cloths) sum += cloth.vertexCount;
    return sum;
  }
};

inline constexpr std::uint8_t kMaxQualities = 4;
inline constexpr std::uint32_t kMaxVertices = 1u << 26;
inline constexpr float kSmallestMaxError = 5e-6f, kLargestMaxError = 1000;

// Whether a stream can have this layout: a codec of ours, 1 to kMaxTemporalLayers layers, one cloth or more,
// none empty, grids whose numbers agree, triangles of vertices that there are and finite rest positions, at
// most kMaxVertices, a max error within the two bounds above.
inline bool isPossible(const StreamLayout& layout) {
  if (!(layout.maxError >= kSmallestMaxError && layout.maxError <= kLargestMaxError)) return false;
  if (layout.normals != NormalMode::none && layout.normals != NormalMode::octahedral) return false;
  if (!isCodec(layout.codec)) return false;
  if (layout.temporalLayers < 1 || layout.temporalLayers > kMaxTemporalLayers) return false;
  if (layout.qualities < 1 || layout.qualities > kMaxQualities) return false;
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

// Of a quality that there is.
constexpr float maxErrorOf(const StreamLayout& layout, std::uint8_t quality) {
  return layout.maxError * static_cast<float>(1u << quality);
}

}  // namespace clothstream::codec
