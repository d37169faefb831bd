// SPDX-License-Identifier: MIT
// Tables of the faces that meet at each vertex.
#include "server/encode/normal_tables.h"

#include <algorithm>

#include "shaders/encode/hierarchical/hierarchical.h"

namespace clothstream::encode {
namespace {

using Face = std::array<std::uint32_t, 4>;  // vertices

std::vector<Face> facesOf(const codec::StreamLayout& layout) {
  std::vector<Face> faces;
  std::uint32_t first = 0;
  for (const codec::ClothLayout& cloth : layout.cloths) {
    for (std::size_t t = 0; t < cloth.triangles.size(); t += 3) {
      const std::uint32_t* corner = &cloth.triangles[t];
      faces.push_back({first + corner[0], first + corner[1], first + corner[2], shared::kNoCorner});
    }
    for (std::uint32_t row = 0; row + 1 < cloth.rows; ++row) {
      for (std::uint32_t column = 0; column + 1 < cloth.columns; ++column) {
        const std::uint32_t p = first + row * cloth.columns + column;
        faces.push_back({p, p + cloth.columns, p + cloth.columns + 1, p + 1});
      }
    }
    first += cloth.vertexCount;
  }
  return faces;
}

template <typename Use>
void forEachCorner(const Face& face, Use&& use) {
  for (const std::uint32_t vertex : face) {
    if (vertex != shared::kNoCorner) use(vertex);
  }
}

}  // namespace

NormalTables makeNormalTables(const codec::StreamLayout& layout,
                              const codec::hierarchical::Hierarchy& hierarchy) {
  NormalTables tables{.faces = facesOf(layout), .facesOf = {}};
  const std::uint32_t vertices = layout.vertexCount();
  std::vector<std::uint32_t> next(vertices + 1, 0);
  for (const Face& face : tables.faces)
    forEachCorner(face, [&](std::uint32_t vertex) { ++next[vertex + 1]; });
  next[0] = vertices + 1;
  for (std::uint32_t v = 0; v < vertices; ++v) next[v + 1] += next[v];
  tables.facesOf = next;
  tables.facesOf.resize(next.back());
  for (std::uint32_t f = 0; f < tables.faces.size(); ++f)
    forEachCorner(tables.faces[f], [&](std::uint32_t vertex) { tables.facesOf[next[vertex]++] = f; });
  std::vector<std::uint32_t> slotOf(vertices);
  for (std::uint32_t slot = 0; slot < vertices; ++slot) slotOf[hierarchy.vertexOf[slot]] = slot;
  for (Face& face : tables.faces) {
    for (std::uint32_t& corner : face) corner = corner == shared::kNoCorner ? corner : slotOf[corner];
  }
  return tables;
}

}  // namespace clothstream::encode
