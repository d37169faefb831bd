// SPDX-License-Identifier: MIT
// Normals that follow from positions, in integers.
#include "proto/codec/hierarchical/normal_prediction.h"

#include <bit>

namespace clothstream::codec::hierarchical {
namespace {

constexpr int kNormalBits = 15;

// The two axes after the top one.
struct Axes {
  explicit Axes(std::uint8_t top_) : top(top_ % 3u), first((top + 1) % 3), second((top + 2) % 3) {}
  std::size_t top, first, second;
};

FacedNormal faced(std::array<std::uint64_t, 3> sum) {
  std::array<std::int64_t, 3> n;
  std::array<std::uint64_t, 3> size;
  std::uint8_t top = 2;
  for (const std::uint8_t c : std::array<std::uint8_t, 3>{2, 0, 1}) {
    n[c] = static_cast<std::int64_t>(sum[c]);
    size[c] = n[c] < 0 ? 0 - sum[c] : sum[c];
    if (size[c] > size[top]) top = c;
  }
  const int down = static_cast<int>(std::bit_width(size[top])) - kNormalBits;
  std::array<std::int32_t, 3> small;
  for (std::size_t c = 0; c < 3; ++c)
    small[c] = static_cast<std::int32_t>(down > 0 ? n[c] >> down : n[c] << -down);
  const Axes axes(top);
  const std::int32_t up = small[axes.top];
  return {encodeOctahedral(small[axes.first], small[axes.second], up < 0 ? -up : up),
          static_cast<std::uint8_t>(up < 0 ? top + 3 : top)};
}

}  // namespace

FacedNormal faceNormal(const float* normal, std::uint8_t top) {
  const Axes axes(top);
  const float turned[]{normal[axes.first], normal[axes.second],
                       top < 3 ? normal[axes.top] : -normal[axes.top]};
  return {encodeOctahedral(turned), top};
}

void unfaceNormal(const FacedNormal& faced, float* normal) {
  const Axes axes(faced.top);
  float turned[3];
  decodeOctahedral(faced.octahedral, turned);
  normal[axes.first] = turned[0];
  normal[axes.second] = turned[1];
  normal[axes.top] = faced.top < 3 ? turned[2] : -turned[2];
}

bool NormalPrediction::allocate(const StreamLayout& layout) {
  const std::size_t vertices = layout.vertexCount();
  return places_.allocate(vertices) && sums_.allocate(vertices) && normals_.allocate(vertices);
}

// Adds to each corner the cross product of a quad's diagonals or of two sides of a triangle.
void NormalPrediction::addFace(const std::uint32_t* corners, std::size_t count) {
  const Place &p = places_[corners[0]], &a = places_[corners[1]], &c = places_[corners[2]];
  const Place& b = places_[corners[count - 1]];
  std::array<std::int64_t, 3> first, second;
  for (std::size_t i = 0; i < 3; ++i) {
    first[i] = count == 4 ? std::int64_t{c[i]} - p[i] : std::int64_t{a[i]} - p[i];
    second[i] = count == 4 ? std::int64_t{b[i]} - a[i] : std::int64_t{c[i]} - p[i];
  }
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
    // Factors are below 2^28, products below 2^57.
    const auto cross = static_cast<std::uint64_t>(first[j] * second[k] - first[k] * second[j]);
    for (std::size_t corner = 0; corner < count; ++corner) sums_[corners[corner]][i] += cross;
  }
}

std::span<const FacedNormal> NormalPrediction::predict(const StreamLayout& layout,
                                                       const Predictor& predictor) {
  const std::span<const Node> nodes = predictor.made();
  for (std::size_t slot = 0; slot < nodes.size(); ++slot) {
    const std::uint32_t vertex = predictor.hierarchy().vertexOf[slot];
    places_[vertex] = {nodes[slot].x, nodes[slot].y, nodes[slot].z};
    sums_[vertex] = {};
  }
  std::uint32_t first = 0;
  for (const ClothLayout& cloth : layout.cloths) {
    for (std::size_t t = 0; t < cloth.triangles.size(); t += 3) {
      const std::uint32_t* corner = &cloth.triangles[t];
      const std::uint32_t corners[]{first + corner[0], first + corner[1], first + corner[2]};
      addFace(corners, 3);
    }
    for (std::uint32_t row = 0; row + 1 < cloth.rows; ++row) {
      for (std::uint32_t column = 0; column + 1 < cloth.columns; ++column) {
        const std::uint32_t p = first + row * cloth.columns + column;
        const std::uint32_t corners[]{p, p + cloth.columns, p + cloth.columns + 1, p + 1};
        addFace(corners, 4);
      }
    }
    first += cloth.vertexCount;
  }
  for (std::size_t vertex = 0; vertex < nodes.size(); ++vertex) normals_[vertex] = faced(sums_[vertex]);
  return {normals_.data(), nodes.size()};
}

}  // namespace clothstream::codec::hierarchical
