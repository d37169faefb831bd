// SPDX-License-Identifier: MIT
// Counts the places where a cloth passes through itself or through another cloth.
#include "tests/simulation/intersections.h"

#include <cstdint>
#include <vector>

#include "clients/measure/intersections.h"
#include "server/model/mesh.h"

namespace clothstream::tests {

std::size_t intersections(const model::Scene& scene, std::span<const model::Vec3> positions) {
  std::vector<measure::Triangle> triangles;
  std::uint32_t first = 0;
  for (const model::Cloth& cloth : scene.cloths) {
    for (const model::Triangle& triangle : model::clothTriangles(cloth))
      triangles.push_back({first + triangle[0], first + triangle[1], first + triangle[2]});
    first += cloth.nodeCount();
  }
  static_assert(sizeof(model::Vec3) == 3 * sizeof(float));
  const std::span<const float> numbers(positions.data()->data(), 3 * positions.size());
  const measure::Intersections::Range all;
  return measure::Intersections(triangles).count(numbers, std::span(&all, 1))[0];
}

}  // namespace clothstream::tests
