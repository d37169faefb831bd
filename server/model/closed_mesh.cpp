// SPDX-License-Identifier: MIT
#include "server/model/closed_mesh.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

namespace clothstream::model {
namespace {

// Makes up for the rounding of the vertices' distances.
constexpr float kReachRounding = 1.000001f;
constexpr std::size_t kCrowdingSamples = 256;

// A directed edge of a triangle.
struct HalfEdge {
  std::uint32_t low, high;  // its ends, low < high
  bool forwards;            // from low to high
  std::uint32_t triangle, side;
};

auto endsOf(const HalfEdge& edge) {
  return std::tuple(edge.low, edge.high);
}

ClosedMeshProblem wholeProblem(std::string text) {
  return {std::nullopt, std::move(text)};
}

// Sets the neighbours, or returns why there are none.
std::optional<ClosedMeshProblem> connect(ClosedMesh& mesh) {
  std::vector<HalfEdge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (std::uint32_t side = 0; side < 3; ++side) {
      const std::uint32_t from = mesh.triangles[t][side], to = mesh.triangles[t][(side + 1) % 3];
      edges.push_back({std::min(from, to), std::max(from, to), from < to, t, side});
    }
  std::ranges::sort(edges, [](const HalfEdge& a, const HalfEdge& b) {
    return std::tuple(a.low, a.high, a.triangle, a.side) < std::tuple(b.low, b.high, b.triangle, b.side);
  });
  mesh.neighbours.assign(mesh.triangles.size(), {});
  for (std::size_t i = 0; i < edges.size(); i += 2) {
    const HalfEdge& one = edges[i];
    const bool alone = i + 1 == edges.size() || endsOf(edges[i + 1]) != endsOf(one);
    if (alone) return ClosedMeshProblem{one.triangle, "is not closed: one of its edges has no neighbour"};
    const HalfEdge& other = edges[i + 1];
    if (i + 2 < edges.size() && endsOf(edges[i + 2]) == endsOf(one))
      return ClosedMeshProblem{edges[i + 2].triangle, "has an edge that two other triangles have"};
    if (one.forwards == other.forwards)
      return ClosedMeshProblem{other.triangle, "shows its other side than its neighbour"};
    mesh.neighbours[one.triangle][one.side] = other.triangle;
    mesh.neighbours[other.triangle][other.side] = one.triangle;
  }
  return std::nullopt;
}

}  // namespace

Eigen::Vector3d areaVector(std::span<const Vec3> vertices, const TriangleCorners& triangle) {
  const Eigen::Vector3d a = vertices[triangle[0]].cast<double>();
  return (vertices[triangle[1]].cast<double>() - a).cross(vertices[triangle[2]].cast<double>() - a) / 2;
}

std::vector<std::uint32_t> weld(std::vector<Vec3>& vertices, std::vector<TriangleCorners>& triangles) {
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto place = [&](std::uint32_t i) {
    return std::tuple(vertices[i].x(), vertices[i].y(), vertices[i].z());
  };
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return std::tuple_cat(place(a), std::tuple(a)) < std::tuple_cat(place(b), std::tuple(b));
  });
  std::vector<std::uint32_t> first(vertices.size());
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && place(order[i]) == place(order[i - 1]) ? first[order[i - 1]] : order[i];
  constexpr std::uint32_t kUnused = ~0u;
  std::vector<std::uint32_t> number(vertices.size(), kUnused);
  for (TriangleCorners& triangle : triangles)
    for (std::uint32_t& corner : triangle) number[corner = first[corner]] = 0;
  std::vector<Vec3> kept;
  std::vector<std::uint32_t> sources;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    if (number[i] == kUnused) continue;
    number[i] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(vertices[i]);
    sources.push_back(static_cast<std::uint32_t>(i));
  }
  for (TriangleCorners& triangle : triangles)
    for (std::uint32_t& corner : triangle) corner = number[corner];
  vertices = std::move(kept);
  return sources;
}

double triangleCrowding(std::span<const Vec3> vertices, std::span<const TriangleCorners> triangles,
                        std::size_t samples) {
  struct Box {
    Vec3 low, high;
  };
  std::vector<Box> boxes;
  boxes.reserve(triangles.size());
  for (const TriangleCorners& triangle : triangles) {
    const Vec3 &a = vertices[triangle[0]], &b = vertices[triangle[1]], &c = vertices[triangle[2]];
    boxes.push_back({a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c)});
  }
  double squares = 0, sampled = 0;
  const auto sample = [&](const Vec3& point) {
    const Eigen::Array3f at = point.array();
    const auto around = static_cast<double>(std::ranges::count_if(boxes, [&](const Box& box) {
      return (box.low.array() <= at).all() && (at <= box.high.array()).all();
    }));
    squares += around * around;
    ++sampled;
  };
  const auto strideOf = [samples](const auto& list) { return (list.size() + samples - 1) / samples; };
  for (std::size_t i = 0; i < vertices.size(); i += strideOf(vertices)) sample(vertices[i]);
  for (std::size_t i = 0; i < boxes.size(); i += strideOf(boxes)) sample((boxes[i].low + boxes[i].high) / 2);
  return std::sqrt(squares / sampled);
}

std::variant<ClosedMesh, ClosedMeshProblem> makeClosedMesh(std::vector<Vec3> vertices,
                                                           std::vector<TriangleCorners> triangles) {
  if (triangles.size() < 4 || triangles.size() > kMaxClosedMeshTriangles)
    return wholeProblem("must have 4 to " + std::to_string(kMaxClosedMeshTriangles) + " triangles, but has " +
                        std::to_string(triangles.size()));
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (const std::uint32_t corner : triangles[t])
      if (corner >= vertices.size())
        return ClosedMeshProblem{t, "has the corner " + std::to_string(corner) + ", but there are " +
                                        std::to_string(vertices.size()) + " vertices"};
  std::vector<std::uint32_t> sources = weld(vertices, triangles);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    if (!(areaVector(vertices, triangles[t]).norm() >= kMinTriangleArea))
      return ClosedMeshProblem{t, "has an area below 1e-9 m^2"};
  ClosedMesh mesh{.vertices = std::move(vertices),
                  .triangles = std::move(triangles),
                  .neighbours = {},
                  .sources = std::move(sources),
                  .reach = 0,
                  .skin = {}};
  if (const auto problem = connect(mesh)) return *problem;
  double volume = 0;
  for (const TriangleCorners& triangle : mesh.triangles)
    volume += areaVector(mesh.vertices, triangle).dot(mesh.vertices[triangle[0]].cast<double>()) / 3;
  if (volume <= 0) return wholeProblem("is inside out: its triangles must be counter-clockwise from outside");
  for (const Vec3& vertex : mesh.vertices) mesh.reach = std::max(mesh.reach, kReachRounding * vertex.norm());
  mesh.crowding = triangleCrowding(mesh.vertices, mesh.triangles, kCrowdingSamples);
  return mesh;
}

double arcCosine(double x) {
  const double size = std::min(std::abs(x), 1.0);
  const double angle =
      std::sqrt(1 - size) * (1.5707288 + size * (-0.2121144 + size * (0.0742610 - size * 0.0187293)));
  return x < 0 ? 3.14159265358979 - angle : angle;
}

std::vector<Eigen::Vector3d> vertexPseudonormals(std::span<const Vec3> vertices,
                                                 std::span<const TriangleCorners> triangles) {
  std::vector<Eigen::Vector3d> normals(vertices.size(), Eigen::Vector3d::Zero());
  for (const TriangleCorners& triangle : triangles) {
    const Eigen::Vector3d normal = areaVector(vertices, triangle).normalized();
    for (std::size_t i = 0; i < 3; ++i) {
      const Eigen::Vector3d corner = vertices[triangle[i]].cast<double>();
      const Eigen::Vector3d next = vertices[triangle[(i + 1) % 3]].cast<double>() - corner;
      const Eigen::Vector3d last = vertices[triangle[(i + 2) % 3]].cast<double>() - corner;
      normals[triangle[i]] += arcCosine(next.normalized().dot(last.normalized())) * normal;
    }
  }
  return normals;
}

}  // namespace clothstream::model
