// SPDX-License-Identifier: MIT
#include "server/simulation/collision/surface_table.h"

#include <bit>
#include <utility>

#include "server/simulation/collision/triangle_tree.h"
#include "server/simulation/texel.h"
#include "shaders/collision/solid.h"

namespace clothstream::simulation {
namespace {

using shared::vec4;

vec4 cornerTexel(const model::TriangleCorners& triangle, float w) {
  return {static_cast<float>(triangle[0]), static_cast<float>(triangle[1]), static_cast<float>(triangle[2]),
          w};
}

std::size_t boxCount(std::uint32_t leafCount) {
  return 2 * std::size_t{leafCount};
}

std::size_t texelsOf(std::size_t triangles, std::size_t vertices, std::uint32_t leafCount) {
  return CLOTHSTREAM_TRIANGLE_TEXELS * triangles + CLOTHSTREAM_VERTEX_TEXELS * vertices +
         CLOTHSTREAM_BOX_TEXELS * boxCount(leafCount);
}

}  // namespace

SharedSurface makeSurfaceTable(model::Surface surface) {
  const TriangleTree tree = makeTriangleTree(surface.vertices, surface.triangles);
  auto table = std::make_shared<SurfaceTable>();
  table->leafCount = tree.leafCount;
  table->texels.reserve(texelsOf(surface.triangles.size(), surface.vertices.size(), tree.leafCount));
  std::vector<std::uint32_t> rank(tree.order.size());
  for (std::uint32_t i = 0; i < rank.size(); ++i) rank[tree.order[i]] = i;
  for (const std::uint32_t triangle : tree.order) {
    model::TriangleCorners neighbours = surface.neighbours[triangle];
    for (std::uint32_t& neighbour : neighbours) neighbour = rank[neighbour];
    table->texels.push_back(cornerTexel(surface.triangles[triangle], 0));
    table->texels.push_back(cornerTexel(neighbours, surface.rims[triangle]));
  }
  const std::vector<Eigen::Vector3d> normals =
      model::vertexPseudonormals(surface.vertices, surface.triangles);
  for (std::size_t i = 0; i < surface.vertices.size(); ++i) {
    table->texels.push_back(texel(surface.vertices[i], 0));
    table->texels.push_back(texel(model::Vec3(normals[i].cast<float>()), 0));
  }
  for (const TriangleTree::Box& box : tree.boxes) {
    table->texels.push_back(texel(box.low, 0));
    table->texels.push_back(texel(box.high, 0));
  }
  table->surface = std::move(surface);
  return table;
}

std::size_t surfaceTexels(const SurfaceTable& table) {
  return CLOTHSTREAM_SOLID_TEXELS + table.texels.size();
}

std::vector<vec4> surfaceHeader(const SurfaceTable& table, std::size_t first) {
  const std::size_t firstTriangle = first + CLOTHSTREAM_SOLID_TEXELS;
  const std::size_t firstVertex =
      firstTriangle + CLOTHSTREAM_TRIANGLE_TEXELS * table.surface.triangles.size();
  const std::size_t firstBox = firstVertex + CLOTHSTREAM_VERTEX_TEXELS * table.surface.vertices.size();
  return {{static_cast<float>(firstTriangle), static_cast<float>(firstVertex), static_cast<float>(firstBox),
           static_cast<float>(table.leafCount)},
          {static_cast<float>(table.surface.triangles.size()), CLOTHSTREAM_VERTEX_TEXELS, 0, 0}};
}

std::size_t mostSurfaceTexels() {
  // Triangles that share no vertex, in trees whose leaves are half full. Each tree has one leaf at least.
  const std::size_t triangles = model::kMaxSceneSurfaceTriangles;
  const std::size_t leaves = 2 * triangles / kLeafTriangles + model::kMaxSceneSurfaces;
  const std::size_t all = CLOTHSTREAM_SOLID_TEXELS * model::kMaxSceneSurfaces +
                          texelsOf(triangles, 3 * triangles, static_cast<std::uint32_t>(leaves));
  static_assert(model::kMaxSceneSurfaceTriangles <= 200'000, "numbers of texels are floats");
  return all + all / 2;
}

}  // namespace clothstream::simulation
