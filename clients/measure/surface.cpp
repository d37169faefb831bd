// SPDX-License-Identifier: MIT
#include "clients/measure/surface.h"

#include <cmath>

namespace clothstream::measure {
namespace {

double areaOf(std::span<const float> rest, const Triangle& triangle) {
  const Point a = pointAt(rest, triangle[0]), b = pointAt(rest, triangle[1]), c = pointAt(rest, triangle[2]);
  const Point u{b[0] - a[0], b[1] - a[1], b[2] - a[2]}, v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  return 0.5 * std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]);
}

std::span<const Triangle> trianglesOf(const Surface& surface, const Cloth& cloth) {
  return std::span(surface.triangles).subspan(cloth.firstTriangle, cloth.triangleCount);
}

}  // namespace

Surface surfaceOf(const cs_client* client) {
  Surface surface;
  const float* const rest = cs_positions(client);
  surface.rest.assign(rest, rest + 3 * std::size_t{cs_vertex_count(client)});
  std::uint32_t count = 0;
  const std::uint32_t* const indices = cs_triangles(client, &count);
  for (std::size_t i = 0; i + 2 < count; i += 3)
    surface.triangles.push_back({indices[i], indices[i + 1], indices[i + 2]});
  cs_cloth cloth;
  for (std::uint32_t i = 0; cs_get_cloth(client, i, &cloth) != 0; ++i)
    surface.cloths.push_back({cloth.name, cloth.first_vertex, cloth.vertex_count, cloth.rows, cloth.columns,
                              cloth.first_index / 3, cloth.index_count / 3});
  return surface;
}

double areaOf(const Surface& surface, const Cloth& cloth) {
  double area = 0;
  for (const Triangle& triangle : trianglesOf(surface, cloth)) area += areaOf(surface.rest, triangle);
  return area;
}

std::vector<double> massesOf(const Surface& surface, const Cloth& cloth, double arealMass) {
  const double even = cloth.rows > 0 ? arealMass * areaOf(surface, cloth) / cloth.vertexCount : 0;
  std::vector<double> masses(cloth.vertexCount, even);
  if (cloth.rows > 0) return masses;
  for (const Triangle& triangle : trianglesOf(surface, cloth))
    for (const std::uint32_t vertex : triangle)
      masses[vertex - cloth.firstVertex] += arealMass * areaOf(surface.rest, triangle) / 3;
  return masses;
}

}  // namespace clothstream::measure
