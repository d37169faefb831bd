// SPDX-License-Identifier: MIT
#include "server/simulation/collision/solid_tables.h"

#include <algorithm>
#include <cassert>

#include "server/model/distance_grid.h"
#include "server/simulation/collision/triangle_tree.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using shared::vec4;

vec4 numbers(const model::TriangleCorners& triangle) {
  return {static_cast<float>(triangle[0]), static_cast<float>(triangle[1]), static_cast<float>(triangle[2]),
          0};
}

// Appends a mesh and its tree. Returns the number of its leaves.
std::uint32_t append(const model::ClosedMesh& mesh, std::vector<vec4>& texels) {
  const TriangleTree tree = makeTriangleTree(mesh.vertices, mesh.triangles);
  const std::size_t record = texels.size();
  const std::size_t firstTriangle = record + CLOTHSTREAM_SOLID_TEXELS;
  const std::size_t firstVertex = firstTriangle + CLOTHSTREAM_TRIANGLE_TEXELS * mesh.triangles.size();
  const std::size_t vertexTexels = mesh.skin ? CLOTHSTREAM_MOVING_VERTEX_TEXELS : CLOTHSTREAM_VERTEX_TEXELS;
  const std::size_t firstBox = firstVertex + vertexTexels * mesh.vertices.size();
  texels.push_back({static_cast<float>(firstTriangle), static_cast<float>(firstVertex),
                    static_cast<float>(firstBox), static_cast<float>(tree.leafCount)});
  const std::size_t boxTexels = mesh.skin ? CLOTHSTREAM_MOVING_BOX_TEXELS : CLOTHSTREAM_BOX_TEXELS;
  const std::size_t firstGrid = firstBox + boxTexels * tree.boxes.size();
  texels.push_back({static_cast<float>(mesh.triangles.size()), static_cast<float>(vertexTexels),
                    mesh.distanceCell > 0 ? static_cast<float>(firstGrid) : 0, 0});

  std::vector<std::uint32_t> rank(tree.order.size());
  for (std::uint32_t i = 0; i < rank.size(); ++i) rank[tree.order[i]] = i;
  for (const std::uint32_t triangle : tree.order) {
    model::TriangleCorners neighbours = mesh.neighbours[triangle];
    for (std::uint32_t& neighbour : neighbours) neighbour = rank[neighbour];
    texels.push_back(numbers(mesh.triangles[triangle]));
    texels.push_back(numbers(neighbours));
  }
  const std::vector<Eigen::Vector3d> normals = model::vertexPseudonormals(mesh.vertices, mesh.triangles);
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (std::size_t k = 0; k < vertexTexels; k += CLOTHSTREAM_VERTEX_TEXELS) {
      texels.push_back(texel(mesh.vertices[i], 0));
      texels.push_back(texel(model::Vec3(normals[i].cast<float>()), 0));
    }
  }
  for (const TriangleTree::Box& box : tree.boxes) {
    for (std::size_t k = 0; k < boxTexels; k += CLOTHSTREAM_BOX_TEXELS) {
      texels.push_back(texel(box.low, 0));
      texels.push_back(texel(box.high, 0));
    }
  }
  assert(texels.size() == firstGrid);
  if (mesh.distanceCell > 0) {
    const model::DistanceGrid grid = model::distanceGridOf(mesh, mesh.distanceCell);
    const auto count = [&](std::size_t axis) { return static_cast<float>(grid.counts[axis]); };
    texels.push_back(texel(grid.origin, grid.cell));
    texels.push_back({count(0), count(1), count(2), 1 / grid.cell});
    texels.resize(texels.size() + grid.points());  // the device samples them
  }
  return tree.leafCount;
}

}  // namespace

std::size_t SolidTables::indexOf(const model::Solid& solid) const {
  const auto found = std::ranges::find(solids, solid);
  assert(found != solids.end());
  return static_cast<std::size_t>(found - solids.begin());
}

SolidTables solidTables(std::span<const model::Collider> colliders) {
  SolidTables tables;
  for (const model::Collider& collider : colliders) {
    const auto* solid = std::get_if<model::Solid>(&collider.shape);
    if (solid == nullptr || std::ranges::find(tables.solids, *solid) != tables.solids.end()) continue;
    tables.solids.push_back(*solid);
    tables.places.push_back(static_cast<std::uint32_t>(tables.texels.size()));
    tables.leafCounts.push_back(append(**solid, tables.texels));
    tables.reaches.push_back((*solid)->reach);
    tables.motions.push_back(0);
  }
  assert(tables.texels.size() < 1u << 24);  // numbers of texels are floats
  return tables;
}

std::vector<shared::NodeTileRecord> nodeTiles(std::span<const model::Cloth> cloths, std::uint32_t size) {
  return nodeTiles(clothOffsets(cloths), size);
}

std::vector<shared::NodeTileRecord> nodeTiles(std::span<const std::uint32_t> offsets, std::uint32_t size) {
  std::vector<shared::NodeTileRecord> tiles;
  for (std::size_t cloth = 0; cloth + 1 < offsets.size(); ++cloth)
    for (std::uint32_t first = 0; first < offsets[cloth + 1] - offsets[cloth]; first += size)
      tiles.push_back({static_cast<float>(cloth), static_cast<float>(first), 0, 0});
  return tiles;
}

}  // namespace clothstream::simulation
