// SPDX-License-Identifier: MIT
// Vertex normals from positions.
#include "proto/codec/vertex_normals.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace clothstream::codec {
namespace {

struct Vec3 {
  float x, y, z;
};

Vec3 load(const float* positions, std::size_t vertex) {
  const float* p = positions + 3 * vertex;
  return {p[0], p[1], p[2]};
}
Vec3 operator-(Vec3 a, Vec3 b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
Vec3 operator+(Vec3 a, Vec3 b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
Vec3 cross(Vec3 a, Vec3 b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

void store(float* normals, std::size_t vertex, Vec3 sum) {
  const float squared = sum.x * sum.x + sum.y * sum.y + sum.z * sum.z;
  Vec3 n{0, 0, 1};
  if (squared >= 1e-30f) {
    const float scale = 1.0f / std::sqrt(squared);
    n = {sum.x * scale, sum.y * scale, sum.z * scale};
  }
  float* out = normals + 3 * vertex;
  out[0] = n.x;
  out[1] = n.y;
  out[2] = n.z;
}

void computeGridNormals(const ClothLayout& cloth, const float* positions, float* normals) {
  const std::size_t columns = cloth.columns;
  for (std::uint32_t row = 0; row < cloth.rows; ++row) {
    for (std::uint32_t column = 0; column < cloth.columns; ++column) {
      const std::size_t i = row * columns + column;
      const bool up = row > 0, down = row + 1 < cloth.rows, left = column > 0,
                 right = column + 1 < cloth.columns;
      const Vec3 p = load(positions, i);
      Vec3 sum{0, 0, 0};
      const auto quad = [&](std::size_t a, std::size_t diagonal, std::size_t b) {
        sum = sum + cross(load(positions, diagonal) - p, load(positions, b) - load(positions, a));
      };
      if (up && right) quad(i + 1, i - columns + 1, i - columns);
      if (up && left) quad(i - columns, i - columns - 1, i - 1);
      if (down && left) quad(i - 1, i + columns - 1, i + columns);
      if (down && right) quad(i + columns, i + columns + 1, i + 1);
      store(normals, i, sum);
    }
  }
}

void computeMeshNormals(const ClothLayout& cloth, const float* positions, float* normals) {
  std::fill_n(normals, 3 * std::size_t{cloth.vertexCount}, 0.0f);
  for (std::size_t t = 0; t < cloth.triangles.size(); t += 3) {
    const std::uint32_t* corner = &cloth.triangles[t];
    const Vec3 p = load(positions, corner[0]);
    const Vec3 area = cross(load(positions, corner[1]) - p, load(positions, corner[2]) - p);
    for (std::size_t i = 0; i < 3; ++i) {
      float* sum = normals + 3 * std::size_t{corner[i]};
      sum[0] += area.x;
      sum[1] += area.y;
      sum[2] += area.z;
    }
  }
  for (std::size_t i = 0; i < cloth.vertexCount; ++i) store(normals, i, load(normals, i));
}

}  // namespace

void computeVertexNormals(const StreamLayout& layout, const float* positions, float* normals) {
  for (const ClothLayout& cloth : layout.cloths) {
    if (cloth.rows > 0) {
      computeGridNormals(cloth, positions, normals);
    } else {
      computeMeshNormals(cloth, positions, normals);
    }
    positions += 3 * std::size_t{cloth.vertexCount};
    normals += 3 * std::size_t{cloth.vertexCount};
  }
}

}  // namespace clothstream::codec
