// SPDX-License-Identifier: MIT
#include "server/model/surface.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace clothstream::model {
namespace {

constexpr std::size_t kSurfaceCrowdingSamples = 64;

// A directed edge of a triangle.
struct SurfaceEdge {
  std::uint32_t low, high;  // its ends, low < high
  bool forwards;            // from low to high
  std::uint32_t triangle, side;
};

bool haveSameEnds(const SurfaceEdge& a, const SurfaceEdge& b) {
  return a.low == b.low && a.high == b.high;
}

// Whether the least height of a triangle is too small for a normal. A triangle with a corner twice has none.
bool isTooThin(const std::vector<Vec3>& vertices, const TriangleCorners& triangle) {
  double longest = 0;
  for (std::size_t k = 0; k < 3; ++k)
    longest = std::max(
        longest,
        (vertices[triangle[(k + 1) % 3]].cast<double>() - vertices[triangle[k]].cast<double>()).norm());
  const double area = areaVector(vertices, triangle).norm();
  return area < kMinTriangleArea || 2 * area < kLeastTriangleHeight * longest;
}

void markRim(Surface& surface, const SurfaceEdge& edge) {
  surface.neighbours[edge.triangle][edge.side] = edge.triangle;
  surface.rims[edge.triangle] |= static_cast<std::uint8_t>(1u << edge.side);
}

void connectSurface(Surface& surface) {
  std::vector<SurfaceEdge> edges;
  edges.reserve(3 * surface.triangles.size());
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t)
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint32_t from = surface.triangles[t][side], to = surface.triangles[t][(side + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), from < to, t, side});
    }
  std::ranges::sort(edges, [](const SurfaceEdge& a, const SurfaceEdge& b) {
    return std::tuple(a.low, a.high, a.triangle, a.side) < std::tuple(b.low, b.high, b.triangle, b.side);
  });
  surface.neighbours.assign(surface.triangles.size(), {});
  surface.rims.assign(surface.triangles.size(), 0);
  for (std::size_t first = 0, end = 0; first < edges.size(); first = end) {
    while (end < edges.size() && haveSameEnds(edges[end], edges[first])) ++end;
    const SurfaceEdge &one = edges[first], &last = edges[end - 1];
    if (end - first == 2 && one.forwards != last.forwards) {
      surface.neighbours[one.triangle][one.side] = last.triangle;
      surface.neighbours[last.triangle][last.side] = one.triangle;
    } else {
      for (std::size_t i = first; i < end; ++i) markRim(surface, edges[i]);
    }
  }
}

std::optional<SurfaceProblem> problemOf(const std::vector<Vec3>& vertices,
                                        const std::vector<TriangleCorners>& triangles) {
  if (triangles.empty() || triangles.size() > kMaxSurfaceTriangles)
    return SurfaceProblem{{},
                          {},
                          "must have 1 to " + std::to_string(kMaxSurfaceTriangles) + " triangles, but has " +
                              std::to_string(triangles.size())};
  for (std::size_t i = 0; i < vertices.size(); ++i)
    // A NaN is not within the extent either.
    if (!(vertices[i].cwiseAbs().maxCoeff() <= kMaxSurfaceExtent) || !vertices[i].allFinite())
      return SurfaceProblem{i,
                            {},
                            "must have finite coordinates from -" +
                                std::to_string(static_cast<int>(kMaxSurfaceExtent)) + " to " +
                                std::to_string(static_cast<int>(kMaxSurfaceExtent)) + " m"};
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t corner : triangles[t])
      if (corner >= vertices.size())
        return SurfaceProblem{{},
                              t,
                              "has the corner " + std::to_string(corner) + ", but there are " +
                                  std::to_string(vertices.size()) + " vertices"};
  return std::nullopt;
}

}  // namespace

std::variant<MadeSurface, SurfaceProblem> makeSurface(std::vector<Vec3> vertices,
                                                      std::vector<TriangleCorners> triangles) {
  if (std::optional<SurfaceProblem> problem = problemOf(vertices, triangles)) return std::move(*problem);
  const std::size_t sent = triangles.size();
  std::erase_if(triangles, [&](const TriangleCorners& triangle) { return isTooThin(vertices, triangle); });
  if (triangles.empty())
    return SurfaceProblem{{},
                          {},
                          "has no triangle with a height of at least 0.0001 m and an area of at least 1e-9 "
                          "m^2, so nothing can touch it"};
  static_cast<void>(weld(vertices, triangles));
  MadeSurface made{.surface = {.vertices = std::move(vertices), .triangles = std::move(triangles)},
                   .dropped = 0};
  Surface& surface = made.surface;
  made.dropped = sent - surface.triangles.size();
  connectSurface(surface);
  surface.low = surface.high = surface.vertices.front();
  for (const Vec3& vertex : surface.vertices) {
    surface.low = surface.low.cwiseMin(vertex);
    surface.high = surface.high.cwiseMax(vertex);
  }
  surface.crowding = triangleCrowding(surface.vertices, surface.triangles, kSurfaceCrowdingSamples);
  return made;
}

}  // namespace clothstream::model
