// SPDX-License-Identifier: MIT
#include "clients/xr/stage/topology.h"

#include <array>
#include <cassert>
#include <cmath>
#include <unordered_map>

namespace clothstream::xr {
namespace {

constexpr std::uint32_t kUnused = UINT32_MAX;

bool isGrid(const Shape& shape) {
  return shape.rows > 1 && shape.columns > 1;
}

Eigen::Vector3f nodeOf(const Shape& shape, std::uint32_t node) {
  const float* at = &shape.positions[3 * std::size_t{node - shape.firstNode}];
  return {at[0], at[1], at[2]};
}

struct FaceOfNode {
  std::uint32_t node;
  Stage::Face face;
};

// The faces of proto/codec/vertex_normals.h: the quads of a grid, or the triangles of a mesh.
std::vector<FaceOfNode> facesOf(const Shape& shape) {
  std::vector<FaceOfNode> faces;
  if (!isGrid(shape)) {
    faces.reserve(shape.corners.size());
    for (std::size_t corner = 0; corner < shape.corners.size(); ++corner) {
      const std::size_t first = corner - corner % 3;
      const std::uint32_t p = shape.corners[corner];
      faces.push_back(
          {p, {p, shape.corners[first + (corner + 1) % 3], shape.corners[first + (corner + 2) % 3]}});
    }
    return faces;
  }
  faces.reserve(std::size_t{4} * (shape.rows - 1) * (shape.columns - 1));
  for (std::uint32_t row = 0; row + 1 < shape.rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < shape.columns; ++column) {
      const std::uint32_t p = shape.firstNode + row * shape.columns + column;
      // Counter-clockwise, as seen from the front.
      const std::array<std::uint32_t, 4> ring{p, p + shape.columns, p + shape.columns + 1, p + 1};
      for (std::size_t k = 0; k < 4; ++k)
        faces.push_back({ring[k], {ring[(k + 1) % 4], ring[(k + 2) % 4], ring[(k + 3) % 4]}});
    }
  }
  return faces;
}

void appendFans(const Shape& shape, Stage& stage) {
  const std::vector<FaceOfNode> faces = facesOf(shape);
  if (stage.fanStarts.empty()) stage.fanStarts.push_back(0);
  const auto begin = static_cast<std::uint32_t>(stage.fans.size());
  std::vector<std::uint32_t> next(shape.nodeCount + 1, 0);
  for (const FaceOfNode& face : faces) ++next[face.node - shape.firstNode + 1];
  for (std::uint32_t node = 0; node < shape.nodeCount; ++node) {
    next[node + 1] += next[node];
    stage.fanStarts.push_back(begin + next[node + 1]);
  }
  stage.fans.resize(begin + faces.size());
  for (const FaceOfNode& face : faces) stage.fans[begin + next[face.node - shape.firstNode]++] = face.face;
}

// Metres of cloth per unit of texture coordinates, from the areas of all triangles.
float metresPerUv(const Shape& shape) {
  double cloth = 0, texture = 0;
  for (std::size_t k = 0; k + 2 < shape.corners.size(); k += 3) {
    const Eigen::Vector3f origin = nodeOf(shape, shape.corners[k]);
    const Eigen::Vector3f second = nodeOf(shape, shape.corners[k + 1]) - origin;
    const Eigen::Vector3f third = nodeOf(shape, shape.corners[k + 2]) - origin;
    const auto uv = [&](std::size_t corner) {
      const std::size_t index = 2 * std::size_t{shape.uvIndices[corner]};
      return Eigen::Vector2f(shape.uvs[index], shape.uvs[index + 1]);
    };
    const Eigen::Vector2f a = uv(k + 1) - uv(k), b = uv(k + 2) - uv(k);
    cloth += static_cast<double>(second.cross(third).norm());
    texture += static_cast<double>(std::abs(a.x() * b.y() - a.y() * b.x()));
  }
  return texture > 0 ? static_cast<float>(std::sqrt(cloth / texture)) : 0;
}

void appendGridVertices(const Shape& shape, Stage& stage) {
  const std::uint32_t first = shape.firstNode;
  const float width = (nodeOf(shape, first + shape.columns - 1) - nodeOf(shape, first)).norm();
  const float height =
      (nodeOf(shape, first + (shape.rows - 1) * shape.columns) - nodeOf(shape, first)).norm();
  for (std::uint32_t i = 0; i < shape.nodeCount; ++i)
    stage.vertices.push_back(
        {first + i, static_cast<float>(i % shape.columns) / static_cast<float>(shape.columns - 1) * width,
         -static_cast<float>(i / shape.columns) / static_cast<float>(shape.rows - 1) * height});
}

// Appends the vertices of a mesh, and the indices of its corners. A node with several texture coordinates is
// drawn as several vertices.
void appendMeshVertices(const Shape& shape, std::uint32_t firstVertex, Stage& stage) {
  const float scale = shape.uvIndices.empty() ? 0 : metresPerUv(shape);
  std::vector<std::uint32_t> uvOf(shape.nodeCount, kUnused);
  std::unordered_map<std::uint64_t, std::uint32_t> copies;  // by node and texture coordinate
  for (std::uint32_t i = 0; i < shape.nodeCount; ++i) stage.vertices.push_back({shape.firstNode + i, 0, 0});
  const auto place = [&](DrawnVertex& vertex, std::uint32_t uv) {
    if (shape.uvIndices.empty()) return;
    vertex.u = scale * shape.uvs[2 * std::size_t{uv}];
    vertex.v = scale * shape.uvs[2 * std::size_t{uv} + 1];
  };
  for (std::size_t corner = 0; corner < shape.corners.size(); ++corner) {
    const std::uint32_t node = shape.corners[corner] - shape.firstNode;
    const std::uint32_t uv = shape.uvIndices.empty() ? 0 : shape.uvIndices[corner];
    std::uint32_t vertex = firstVertex + node;
    if (uvOf[node] == kUnused) {
      uvOf[node] = uv;
      place(stage.vertices[vertex], uv);
    } else if (uvOf[node] != uv) {
      const auto [at, isNew] = copies.try_emplace((std::uint64_t{node} << 32) | uv,
                                                  static_cast<std::uint32_t>(stage.vertices.size()));
      vertex = at->second;
      if (isNew) {
        stage.vertices.push_back({shape.firstNode + node, 0, 0});
        place(stage.vertices.back(), uv);
      }
    }
    stage.indices.push_back(vertex);
  }
}

}  // namespace

bool append(const Shape& shape, Stage& stage) {
  assert(shape.firstNode == stage.nodeCount);
  stage.nodeCount += shape.nodeCount;
  appendFans(shape, stage);
  const auto firstVertex = static_cast<std::uint32_t>(stage.vertices.size());
  if (isGrid(shape)) {
    appendGridVertices(shape, stage);
    for (const std::uint32_t node : shape.corners)
      stage.indices.push_back(firstVertex + node - shape.firstNode);
    return true;
  }
  appendMeshVertices(shape, firstVertex, stage);
  return !shape.uvIndices.empty();
}

}  // namespace clothstream::xr
