// SPDX-License-Identifier: MIT
// Closed triangle meshes shared by tests.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "server/model/collider.h"

namespace clothstream::model {

inline Solid solidOf(std::vector<Vec3> vertices, std::vector<TriangleCorners> triangles) {
  return std::make_shared<const ClosedMesh>(
      std::get<ClosedMesh>(makeClosedMesh(std::move(vertices), std::move(triangles))));
}

// Ring around the Y axis: `around` times `across` quads, each of two triangles.
inline Solid torus(float radius, float thickness, std::uint32_t around, std::uint32_t across) {
  const auto angle = [](std::uint32_t i, std::uint32_t n) {
    return 2 * std::acos(-1.0f) * static_cast<float>(i) / static_cast<float>(n);
  };
  std::vector<Vec3> vertices;
  std::vector<TriangleCorners> triangles;
  const auto at = [&](std::uint32_t i, std::uint32_t k) { return (i % around) * across + k % across; };
  for (std::uint32_t i = 0; i < around; ++i)
    for (std::uint32_t k = 0; k < across; ++k) {
      const float u = angle(i, around), v = angle(k, across);
      const float out = radius + thickness * std::cos(v);
      vertices.emplace_back(out * std::cos(u), thickness * std::sin(v), out * std::sin(u));
      triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k)});
      triangles.push_back({at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)});
    }
  return solidOf(std::move(vertices), std::move(triangles));
}

// Box of twelve triangles, centred on the origin.
inline Solid boxMesh(const Vec3& size) {
  std::vector<Vec3> vertices;
  for (const float x : {-0.5f, 0.5f})
    for (const float y : {-0.5f, 0.5f})
      for (const float z : {-0.5f, 0.5f}) vertices.push_back(size.cwiseProduct(Vec3(x, y, z)));
  return solidOf(std::move(vertices), {{0, 1, 3},
                                       {0, 3, 2},
                                       {4, 6, 7},
                                       {4, 7, 5},
                                       {0, 4, 5},
                                       {0, 5, 1},
                                       {2, 3, 7},
                                       {2, 7, 6},
                                       {0, 2, 6},
                                       {0, 6, 4},
                                       {1, 5, 7},
                                       {1, 7, 3}});
}

// Ball of `rings` rings of twice as many quads, with its poles on the Y axis.
inline Solid ballMesh(float radius, std::uint32_t rings) {
  const std::uint32_t around = 2 * rings;
  std::vector<Vec3> vertices{Vec3(0, radius, 0), Vec3(0, -radius, 0)};
  const auto at = [&](std::uint32_t ring, std::uint32_t k) { return 2 + (ring - 1) * around + k % around; };
  for (std::uint32_t ring = 1; ring < rings; ++ring)
    for (std::uint32_t k = 0; k < around; ++k) {
      const float down = std::acos(-1.0f) * static_cast<float>(ring) / static_cast<float>(rings);
      const float u = 2 * std::acos(-1.0f) * static_cast<float>(k) / static_cast<float>(around);
      vertices.push_back(radius *
                         Vec3(std::sin(down) * std::cos(u), std::cos(down), std::sin(down) * std::sin(u)));
    }
  std::vector<TriangleCorners> triangles;
  for (std::uint32_t k = 0; k < around; ++k) {
    triangles.push_back({0, at(1, k + 1), at(1, k)});
    triangles.push_back({1, at(rings - 1, k), at(rings - 1, k + 1)});
    for (std::uint32_t ring = 1; ring + 1 < rings; ++ring) {
      triangles.push_back({at(ring, k), at(ring, k + 1), at(ring + 1, k)});
      triangles.push_back({at(ring + 1, k), at(ring, k + 1), at(ring + 1, k + 1)});
    }
  }
  return solidOf(std::move(vertices), std::move(triangles));
}

// The mesh with sampled distances instead of triangles (distance_grid.h).
inline Solid sampled(const Solid& solid, float cell) {
  ClosedMesh mesh = *solid;
  mesh.distanceCell = cell;
  return std::make_shared<const ClosedMesh>(std::move(mesh));
}

// Rod along X, centred on the origin: `along` times `around` quads, and two ends that are fans.
inline Solid rodMesh(float radius, float length, std::uint32_t around, std::uint32_t along) {
  std::vector<Vec3> vertices{Vec3(-length / 2, 0, 0), Vec3(length / 2, 0, 0)};
  std::vector<TriangleCorners> triangles;
  const auto at = [&](std::uint32_t i, std::uint32_t k) { return 2 + i * around + k % around; };
  for (std::uint32_t i = 0; i <= along; ++i)
    for (std::uint32_t k = 0; k < around; ++k) {
      const float u = 2 * std::acos(-1.0f) * static_cast<float>(k) / static_cast<float>(around);
      const float x = length * (static_cast<float>(i) / static_cast<float>(along) - 0.5f);
      vertices.emplace_back(x, radius * std::cos(u), radius * std::sin(u));
    }
  for (std::uint32_t k = 0; k < around; ++k) {
    triangles.push_back({0, at(0, k + 1), at(0, k)});
    triangles.push_back({1, at(along, k), at(along, k + 1)});
    for (std::uint32_t i = 0; i < along; ++i) {
      triangles.push_back({at(i, k), at(i, k + 1), at(i + 1, k)});
      triangles.push_back({at(i + 1, k), at(i, k + 1), at(i + 1, k + 1)});
    }
  }
  return solidOf(std::move(vertices), std::move(triangles));
}

}  // namespace clothstream::model
