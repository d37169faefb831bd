// SPDX-License-Identifier: MIT
// Builds the meshes shared by tests.
#include "tests/model/meshes.h"

#include <cmath>
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

}  // namespace clothstream::model
