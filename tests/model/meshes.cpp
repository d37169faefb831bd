// SPDX-License-Identifier: MIT
// Builds the meshes shared by tests.
#include "tests/model/meshes.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>

namespace clothstream::model {

MeshShape disc(std::uint32_t rings, float radius) {
  MeshShape shape;
  shape.positions.push_back(Vec3::Zero());
  const auto first = [](std::uint32_t ring) { return ring == 0 ? 0 : 1 + 3 * ring * (ring - 1); };
  for (std::uint32_t ring = 1; ring <= rings; ++ring)
    for (std::uint32_t i = 0; i < 6 * ring; ++i) {
      const double angle = 2 * std::numbers::pi * i / (6.0 * ring);
      const double reach = double{radius} * ring / rings;
      shape.positions.emplace_back(static_cast<float>(reach * std::cos(angle)), 0.0f,
                                   static_cast<float>(-reach * std::sin(angle)));
    }
  for (std::uint32_t ring = 1; ring <= rings; ++ring)
    for (std::uint32_t sector = 0; sector < 6; ++sector)
      for (std::uint32_t i = 0; i < ring; ++i) {
        const std::uint32_t inner = ring - 1, innerCount = std::max(1u, 6 * inner);
        const auto outside = [&](std::uint32_t k) { return first(ring) + k % (6 * ring); };
        const auto inside = [&](std::uint32_t k) { return first(inner) + k % innerCount; };
        const std::uint32_t k = sector * ring + i, j = sector * inner + i;
        shape.triangles.push_back({outside(k), outside(k + 1), inside(j)});
        if (i + 1 < ring) shape.triangles.push_back({inside(j), outside(k + 1), inside(j + 1)});
      }
  shape.submeshes = {{"", 0, static_cast<std::uint32_t>(shape.triangles.size())}};
  return shape;
}

MeshShape icosphere(std::uint32_t parts, float radius) {
  const float golden = (1 + std::sqrt(5.0f)) / 2;
  const Vec3 corners[12] = {{-1, golden, 0}, {1, golden, 0}, {-1, -golden, 0}, {1, -golden, 0},
                            {0, -1, golden}, {0, 1, golden}, {0, -1, -golden}, {0, 1, -golden},
                            {golden, 0, -1}, {golden, 0, 1}, {-golden, 0, -1}, {-golden, 0, 1}};
  constexpr Triangle kFaces[20] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                   {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                   {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                   {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  MeshShape shape;
  // A node is a sum of corners with whole weights; faces share those on their edges.
  std::map<std::array<std::uint32_t, 12>, std::uint32_t> nodes;
  const auto node = [&](const Triangle& face, std::uint32_t i, std::uint32_t k) {
    std::array<std::uint32_t, 12> weights{};
    weights[face[0]] = parts - i - k;
    weights[face[1]] = i;
    weights[face[2]] = k;
    const auto [known, isNew] = nodes.emplace(weights, static_cast<std::uint32_t>(nodes.size()));
    if (isNew) {
      Vec3 sum = Vec3::Zero();
      for (std::size_t c = 0; c < 12; ++c) sum += static_cast<float>(weights[c]) * corners[c];
      shape.positions.push_back(radius * sum.normalized());
    }
    return known->second;
  };
  for (const Triangle& face : kFaces)
    for (std::uint32_t i = 0; i < parts; ++i)
      for (std::uint32_t k = 0; i + k < parts; ++k) {
        shape.triangles.push_back({node(face, i, k), node(face, i + 1, k), node(face, i, k + 1)});
        if (i + k + 1 < parts)
          shape.triangles.push_back({node(face, i + 1, k), node(face, i + 1, k + 1), node(face, i, k + 1)});
      }
  shape.submeshes = {{"", 0, static_cast<std::uint32_t>(shape.triangles.size())}};
  return shape;
}

MeshShape cube(float edge, const Vec3& centre) {
  MeshShape shape;
  for (const float x : {-0.5f, 0.5f})
    for (const float y : {-0.5f, 0.5f})
      for (const float z : {-0.5f, 0.5f}) shape.positions.push_back(centre + edge * Vec3(x, y, z));
  shape.triangles = {{0, 1, 3}, {0, 3, 2}, {4, 6, 7}, {4, 7, 5}, {0, 4, 5}, {0, 5, 1},
                     {2, 3, 7}, {2, 7, 6}, {0, 2, 6}, {0, 6, 4}, {1, 5, 7}, {1, 7, 3}};
  shape.submeshes = {{"", 0, 12}};
  return shape;
}

}  // namespace clothstream::model
