// SPDX-License-Identifier: MIT
// Builds a mesh that can be simulated.
#include "server/meshes/mesh_source.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "server/meshes/numbering.h"
#include "server/meshes/placement.h"
#include "server/meshes/repair.h"
#include "server/meshes/triangulation.h"

namespace clothstream::meshes {
namespace {

using model::Triangle;
using model::Vec3;
using Problem = std::optional<MeshError>;

Problem checkSizes(const MeshSource& source, const MeshOptions& options, const MeshLimits& limits) {
  if (source.vertices.empty()) return MeshError("has no vertices; a cloth needs at least one triangle");
  if (source.faces.empty()) return MeshError("has no faces; a cloth needs at least one triangle");
  if (source.vertices.size() > limits.maxVertices)
    return MeshError(fmt::format("has {} vertices; at most {} are allowed: simplify it",
                                 source.vertices.size(), limits.maxVertices),
                     true);
  if (source.faces.size() > 2 * limits.maxVertices)
    return MeshError(fmt::format("has {} faces; at most {} are allowed: simplify it", source.faces.size(),
                                 2 * limits.maxVertices),
                     true);
  if (!options.repair) return std::nullopt;
  std::uint64_t triangles = 0;
  for (const SourceFace& face : source.faces) triangles += std::max(face.cornerCount, 2u) - 2;
  if (triangles > 2 * limits.maxVertices)
    return MeshError(fmt::format("has polygons that become {} triangles; at most {} are allowed: simplify it",
                                 triangles, 2 * limits.maxVertices),
                     true);
  return std::nullopt;
}

Problem checkNumbers(const MeshSource& source) {
  for (std::size_t i = 0; i < source.vertices.size(); ++i)
    if (!source.vertices[i].allFinite())
      return fmt::format("vertex {} is at {}: coordinates must be finite", i, shownPoint(source.vertices[i]));
  for (std::size_t i = 0; i < source.uvs.size(); ++i)
    if (!source.uvs[i].allFinite()) return fmt::format("texture coordinate {} is not finite", i);
  for (std::size_t f = 0; f < source.faces.size(); ++f) {
    const SourceFace& face = source.faces[f];
    for (std::uint32_t i = 0; i < face.cornerCount; ++i) {
      const SourceCorner corner = source.cornerOf(face, i);
      if (corner.vertex >= source.vertices.size())
        return fmt::format("face {} names vertex {}; there are {}, counted from 0", f, corner.vertex,
                           source.vertices.size());
      if (!source.uvs.empty() && corner.uv >= source.uvs.size())
        return fmt::format("face {} names texture coordinate {}; there are {}, counted from 0", f, corner.uv,
                           source.uvs.size());
    }
  }
  return std::nullopt;
}

// Every face is a triangle or quad.
Problem checkCorners(const MeshSource& source) {
  for (std::size_t f = 0; f < source.faces.size(); ++f)
    if (!source.faces[f].isInline())
      return fmt::format(
          "face {} has {} corners; faces must have 3 or 4: triangulate it when you export, or set \"repair\"",
          f, source.faces[f].cornerCount);
  return std::nullopt;
}

std::string notAQuad(std::size_t f, std::string_view why) {
  return fmt::format("faces {} and {} are not a quad: {}", f, f + 1, why);
}

Problem checkHalves(const MeshSource& source) {
  std::size_t free = 0;
  for (const std::size_t f : source.halves) {
    if (f < free || f + 1 >= source.faces.size())
      return notAQuad(
          f, "a quad is a face and the next one, listed in ascending order, and no face may be in two quads");
    if (source.faces[f].cornerCount != 3 || source.faces[f + 1].cornerCount != 3)
      return notAQuad(f, "its halves must be triangles");
    free = f + 2;
  }
  return std::nullopt;
}

Problem checkFace(const MeshSource& source, std::size_t f, const Numbering& numbering, const Vec3* positions,
                  float minEdge) {
  const SourceFace& face = source.faces[f];
  for (std::uint32_t corner = 0; corner < face.cornerCount; ++corner)
    for (std::uint32_t other = corner + 1; other < face.cornerCount; ++other) {
      const std::uint32_t a = numbering.nodeOfVertex[face.vertices[corner]];
      const std::uint32_t b = numbering.nodeOfVertex[face.vertices[other]];
      const auto what = [&] {
        return fmt::format("face {} is degenerate: its vertices {} and {}", f, face.vertices[corner],
                           face.vertices[other]);
      };
      if (a == b)
        return fmt::format(
            "{} are the same node; delete the face, make weldDistance smaller than their distance, or set "
            "\"repair\"",
            what());
      const float length = (positions[a] - positions[b]).norm();
      if (length < minEdge)
        return fmt::format(
            "{} lie {:g} m apart; at least {:g} is needed: merge them, set the scale, or set \"repair\"",
            what(), length, minEdge);
    }
  return std::nullopt;
}

// Appends the triangles of the face, and the face of each triangle.
Problem appendFace(const MeshSource& source, std::size_t f, const Numbering& numbering,
                   model::MeshShape& shape, std::vector<std::size_t>& faceOfTriangle) {
  const SourceFace& face = source.faces[f];
  const auto node = [&](std::size_t corner) { return numbering.nodeOfVertex[face.vertices[corner]]; };
  const auto at = [&](std::size_t corner) -> const Vec3& { return shape.positions[node(corner)]; };
  const auto append = [&](std::size_t i, std::size_t j, std::size_t k) -> Problem {
    if (isFlat(at(i), at(j), at(k)))
      return fmt::format(
          "face {} is degenerate: its vertices {}, {} and {} lie on one line; delete it, move one, or set "
          "\"repair\"",
          f, face.vertices[i], face.vertices[j], face.vertices[k]);
    shape.triangles.push_back({node(i), node(j), node(k)});
    if (!source.uvs.empty()) shape.uvTriangles.push_back({face.uvs[i], face.uvs[j], face.uvs[k]});
    faceOfTriangle.push_back(f);
    return std::nullopt;
  };
  if (face.cornerCount == 3) return append(0, 1, 2);
  shape.quads.push_back(static_cast<std::uint32_t>(shape.triangles.size()));
  // Equal diagonals: the second one, as in a grid.
  const bool fromFirst = (at(0) - at(2)).squaredNorm() < 0.9999f * (at(1) - at(3)).squaredNorm();
  Problem problem = fromFirst ? append(0, 1, 2) : append(0, 1, 3);
  if (problem) return problem;
  return fromFirst ? append(0, 2, 3) : append(1, 2, 3);
}

// Quads that the source gives as two triangles.
Problem addQuads(const MeshSource& source, const std::vector<std::size_t>& faceOfTriangle,
                 model::MeshShape& shape) {
  for (const std::size_t f : source.halves) {
    const auto t =
        static_cast<std::size_t>(std::ranges::lower_bound(faceOfTriangle, f) - faceOfTriangle.begin());
    const Triangle &first = shape.triangles[t], &second = shape.triangles[t + 1];
    const auto shared = std::ranges::count_if(
        first, [&](std::uint32_t node) { return std::ranges::count(second, node) > 0; });
    if (shared != 2) return notAQuad(f, "they share no edge");
    shape.quads.push_back(static_cast<std::uint32_t>(t));
  }
  std::ranges::sort(shape.quads);
  return std::nullopt;
}

Problem checkEdges(const model::MeshShape& shape, const std::vector<std::size_t>& faceOfTriangle,
                   const std::vector<std::uint32_t>& vertexOfNode) {
  struct Side {
    std::uint32_t low, high, triangle;
    bool upwards;
  };
  std::vector<Side> sides;
  sides.reserve(3 * shape.triangles.size());
  for (std::uint32_t t = 0; t < shape.triangles.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = shape.triangles[t][i], b = shape.triangles[t][(i + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), t, a < b});
    }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::tuple(s.low, s.high, s.triangle); });
  for (std::size_t i = 1; i < sides.size(); ++i) {
    const Side &one = sides[i - 1], &two = sides[i];
    if (one.low != two.low || one.high != two.high) continue;
    const std::string edge =
        fmt::format("between vertices {} and {}", vertexOfNode[one.low], vertexOfNode[one.high]);
    if (i + 1 < sides.size() && sides[i + 1].low == two.low && sides[i + 1].high == two.high)
      return fmt::format(
          "the edge {} is not manifold: faces {}, {} and {} meet there; at most two may: delete one, "
          "separate the layers, or set \"repair\"",
          edge, faceOfTriangle[one.triangle], faceOfTriangle[two.triangle],
          faceOfTriangle[sides[i + 1].triangle]);
    if (one.upwards == two.upwards)
      return fmt::format(
          "faces {} and {} run the same way along the edge {}: their fronts are on different sides; flip one "
          "(in Blender: Recalculate Normals), delete it if it is there twice, or set \"repair\"",
          faceOfTriangle[one.triangle], faceOfTriangle[two.triangle], edge);
  }
  return std::nullopt;
}

// Colouring the springs takes time and memory in proportion to the springs of a node.
Problem checkSprings(const model::Mesh& mesh, const std::vector<std::uint32_t>& vertexOfNode,
                     std::uint32_t maxNodeSprings) {
  std::vector<std::uint32_t> springs(mesh.nodeCount(), 0);
  for (const model::SpringLink& link : mesh.links)
    for (const std::uint32_t node : {link.a, link.b})
      if (++springs[node] > maxNodeSprings)
        return MeshError(fmt::format("vertex {} has more than {} springs: divide the faces around it",
                                     vertexOfNode[node], maxNodeSprings),
                         true);
  return std::nullopt;
}

std::vector<model::Submesh> submeshes(const MeshSource& source,
                                      const std::vector<std::size_t>& faceOfTriangle) {
  std::vector<model::Submesh> found;
  const auto triangleOfFace = [&](std::size_t face) {
    return static_cast<std::uint32_t>(std::ranges::lower_bound(faceOfTriangle, face) -
                                      faceOfTriangle.begin());
  };
  if (source.parts.empty()) found.push_back({"", 0, static_cast<std::uint32_t>(faceOfTriangle.size())});
  for (std::size_t i = 0; i < source.parts.size(); ++i) {
    const std::uint32_t first = triangleOfFace(source.parts[i].firstFace);
    const std::uint32_t end =
        triangleOfFace(i + 1 < source.parts.size() ? source.parts[i + 1].firstFace : source.faces.size());
    if (end > first) found.push_back({source.parts[i].name, first, end - first});
  }
  return found;
}

// Builds the mesh of a source whose faces are triangles and quads. `names` has the vertex of each node that
// errors name.
tl::expected<BuiltMesh, MeshError> build(const MeshSource& source, const std::vector<Vec3>& placed,
                                         Numbering numbering, const std::vector<std::uint32_t>& names,
                                         const MeshLimits& limits) {
  limits.cancellation.check();
  model::MeshShape shape;
  shape.positions.reserve(numbering.vertexOfNode.size());
  for (const std::uint32_t vertex : numbering.vertexOfNode) shape.positions.push_back(placed[vertex]);
  shape.uvs = source.uvs;
  std::vector<std::size_t> faceOfTriangle;
  for (std::size_t f = 0; f < source.faces.size(); ++f) {
    Problem problem = checkFace(source, f, numbering, shape.positions.data(), limits.minEdge);
    if (!problem) problem = appendFace(source, f, numbering, shape, faceOfTriangle);
    if (problem) return tl::unexpected(std::move(*problem));
  }
  limits.cancellation.check();
  if (Problem problem = addQuads(source, faceOfTriangle, shape)) return tl::unexpected(std::move(*problem));
  if (Problem problem = checkEdges(shape, faceOfTriangle, names)) return tl::unexpected(std::move(*problem));
  limits.cancellation.check();
  shape.submeshes = submeshes(source, faceOfTriangle);
  BuiltMesh built;
  built.mesh = model::makeMesh(std::move(shape), limits.cancellation);
  built.nodeOfVertex = std::move(numbering.nodeOfVertex);
  if (Problem problem = checkSprings(built.mesh, names, limits.maxNodeSprings))
    return tl::unexpected(std::move(*problem));
  return built;
}

tl::expected<BuiltMesh, MeshError> buildRepaired(const MeshSource& source, const std::vector<Vec3>& placed,
                                                 float weldDistance, const MeshLimits& limits,
                                                 Repairs& repairs) {
  // Nodes that are closer than the shortest edge would leave faces that are refused.
  const std::vector<std::uint32_t> welded = weld(placed, std::max(weldDistance, limits.minEdge));
  limits.cancellation.check();
  const tl::expected<RepairedMesh, MeshError> repaired = repairMesh(source, placed, welded, limits, repairs);
  if (!repaired) return tl::unexpected(repaired.error());
  limits.cancellation.check();
  std::vector<std::uint32_t> apart(repaired->placed.size());
  std::iota(apart.begin(), apart.end(), 0u);
  const Numbering numbering = numberNodes(repaired->source, repaired->placed, apart);
  std::vector<std::uint32_t> names;
  names.reserve(numbering.vertexOfNode.size());
  for (const std::uint32_t vertex : numbering.vertexOfNode) names.push_back(repaired->origin[vertex]);
  auto built = build(repaired->source, repaired->placed, numbering, names, limits);
  if (!built) return built;
  built->nodeOfVertex.resize(placed.size());
  for (std::size_t i = 0; i < placed.size(); ++i) built->nodeOfVertex[i] = numbering.nodeOfVertex[welded[i]];
  if (apart.size() == placed.size()) return built;
  built->nextCopy.assign(built->mesh.nodeCount(), kNoNode);
  for (std::size_t i = placed.size(); i < apart.size(); ++i) {
    const std::uint32_t node = numbering.nodeOfVertex[repaired->origin[i]], copy = numbering.nodeOfVertex[i];
    built->nextCopy[copy] = std::exchange(built->nextCopy[node], copy);
  }
  return built;
}

}  // namespace

tl::expected<BuiltMesh, MeshError> buildMesh(const MeshSource& source, const MeshOptions& options,
                                             const MeshLimits& limits) {
  Problem problem = checkSizes(source, options, limits);
  if (!problem) problem = checkNumbers(source);
  if (!problem && !options.repair) problem = checkCorners(source);
  if (!problem) problem = checkHalves(source);
  if (problem) return tl::unexpected(std::move(*problem));
  Repairs repairs;
  const auto placed = place(source, options, limits, repairs);
  if (!placed) return tl::unexpected(MeshError(placed.error()));
  limits.cancellation.check();
  tl::expected<BuiltMesh, MeshError> built;
  if (options.repair) {
    built = buildRepaired(source, *placed, options.weldDistance, limits, repairs);
  } else {
    const Numbering numbering = numberNodes(source, *placed, weld(*placed, options.weldDistance));
    built = build(source, *placed, numbering, numbering.vertexOfNode, limits);
  }
  if (built) built->repairs = repairs;
  return built;
}

}  // namespace clothstream::meshes
