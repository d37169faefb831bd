// SPDX-License-Identifier: MIT
// Surfaces of a real room for tests.
#pragma once

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <variant>
#include <vector>

#include "server/model/surface.h"

namespace clothstream::model {

struct Triangles {
  std::vector<Vec3> vertices;
  std::vector<TriangleCorners> triangles;
};

// A rectangle in the XZ plane around the origin, `cells` x `cells` squares of two triangles, its front up.
// `height` gives y, m.
template <typename Height>
Triangles terrain(float width, float depth, std::uint32_t cells, const Height& height) {
  Triangles made;
  for (std::uint32_t row = 0; row <= cells; ++row)
    for (std::uint32_t column = 0; column <= cells; ++column) {
      const float x = width * (static_cast<float>(column) / static_cast<float>(cells) - 0.5f);
      const float z = depth * (static_cast<float>(row) / static_cast<float>(cells) - 0.5f);
      made.vertices.emplace_back(x, height(x, z), z);
    }
  const std::uint32_t across = cells + 1;
  for (std::uint32_t row = 0; row < cells; ++row)
    for (std::uint32_t column = 0; column < cells; ++column) {
      const std::uint32_t a = row * across + column, b = a + 1, c = a + across, d = c + 1;
      made.triangles.push_back({a, c, b});
      made.triangles.push_back({b, c, d});
    }
  return made;
}

inline Triangles flat(float width, float depth, std::uint32_t cells = 1) {
  return terrain(width, depth, cells, [](float, float) { return 0.0f; });
}

// Waves of 4 cm, 25 cm long.
inline float waves(float x, float z) {
  return 0.02f * (std::sin(25 * x) + std::cos(25 * z));
}

// The floor and two walls of a corner that stands at the origin, 1 m long; their fronts look into the room,
// which is at positive coordinates.
inline Triangles corner() {
  const auto p = [](float x, float y, float z) { return Vec3(x, y, z); };
  return {{p(0, 0, 0), p(1, 0, 0), p(0, 1, 0), p(0, 0, 1), p(1, 0, 1), p(1, 1, 0), p(0, 1, 1)},
          {{0, 3, 1}, {1, 3, 4}, {0, 1, 2}, {1, 5, 2}, {0, 2, 3}, {2, 6, 3}}};
}

// Throws std::invalid_argument with the problem.
inline Surface surfaceOf(const Triangles& from) {
  auto made = makeSurface(from.vertices, from.triangles);
  if (auto* problem = std::get_if<SurfaceProblem>(&made)) throw std::invalid_argument(problem->text);
  return std::move(std::get<MadeSurface>(made).surface);
}

}  // namespace clothstream::model
