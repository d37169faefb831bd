// SPDX-License-Identifier: MIT
// Cloths of a scene as vertices and triangles at rest.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "clients/core/core.h"

namespace clothstream::measure {

using Triangle = std::array<std::uint32_t, 3>;
using Point = std::array<double, 3>;

// Part of the vertices and triangles of a surface.
struct Cloth {
  std::string name;
  std::uint32_t firstVertex = 0, vertexCount = 0;
  std::uint32_t rows = 0, columns = 0;  // 0 if the cloth is not a grid; vertices of a grid are row-major
  std::size_t firstTriangle = 0, triangleCount = 0;
};

struct Surface {
  std::vector<Cloth> cloths;        // in the order of their vertices
  std::vector<Triangle> triangles;  // vertices of the surface
  std::vector<float> rest;          // metres, 3 floats per vertex

  std::size_t vertexCount() const { return rest.size() / 3; }
};

// The client must have its description, but no frame yet, because it shows the rest state until then.
Surface surfaceOf(const cs_client* client);

inline Point minus(const Point& a, const Point& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline Point pointAt(std::span<const float> positions, std::size_t vertex) {
  return {double{positions[3 * vertex]}, double{positions[3 * vertex + 1]},
          double{positions[3 * vertex + 2]}};
}

// Mass of each vertex of a cloth with this mass per area at rest, kg. A grid spreads the mass evenly over its
// vertices, a mesh by a third of the area of each triangle, as the server does.
std::vector<double> massesOf(const Surface& surface, const Cloth& cloth, double arealMass);
// Area of a cloth at rest, m^2.
double areaOf(const Surface& surface, const Cloth& cloth);

}  // namespace clothstream::measure
