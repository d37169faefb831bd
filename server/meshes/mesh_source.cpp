// SPDX-License-Identifier: MIT
// Builds a mesh that can be simulated.
#include "server/meshes/mesh_source.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <random>
#include <tuple>
#include <unordered_map>

#include <fmt/format.h>

namespace clothstream::meshes {
namespace {

using model::Triangle;
using model::Vec3;
using Problem = std::optional<std::string>;

std::string shown(const Vec3& p) {
  return fmt::format("({:g}, {:g}, {:g})", p.x(), p.y(), p.z());
}

Problem checkSizes(const MeshSource& source, const MeshLimits& limits) {
  if (source.vertices.empty()) return "has no vertices; a cloth needs at least one triangle";
  if (source.faces.empty()) return "has no faces; a cloth needs at least one triangle";
  if (source.vertices.size() > limits.maxVertices)
    return fmt::format("has {} vertices; at most {} are allowed: simplify it", source.vertices.size(),
                       limits.maxVertices);
  if (source.faces.size() > 2 * limits.maxVertices)
    return fmt::format("has {} faces; at most {} are allowed: simplify it", source.faces.size(),
                       2 * limits.maxVertices);
  return std::nullopt;
}

Problem checkNumbers(const MeshSource& source) {
  for (std::size_t i = 0; i < source.vertices.size(); ++i)
    if (!source.vertices[i].allFinite())
      return fmt::format("vertex {} is at {}: coordinates must be finite", i, shown(source.vertices[i]));
  for (std::size_t i = 0; i < source.uvs.size(); ++i)
    if (!source.uvs[i].allFinite()) return fmt::format("texture coordinate {} is not finite", i);
  for (std::size_t f = 0; f < source.faces.size(); ++f) {
    const SourceFace& face = source.faces[f];
    for (std::uint32_t corner = 0; corner < face.cornerCount; ++corner) {
      if (face.vertices[corner] >= source.vertices.size())
        return fmt::format("face {} names vertex {}; there are {}, counted from 0", f, face.vertices[corner],
                           source.vertices.size());
      if (!source.uvs.empty() && face.uvs[corner] >= source.uvs.size())
        return fmt::format("face {} names texture coordinate {}; there are {}, counted from 0", f,
                           face.uvs[corner], source.uvs.size());
    }
  }
  return std::nullopt;
}

Problem place(const MeshSource& source, const MeshOptions& options, const MeshLimits& limits,
              std::vector<Vec3>& placed) {
  const Eigen::Matrix3d rotation = options.pose.orientation.cast<double>().toRotationMatrix();
  const Eigen::Vector3d origin = options.pose.position.cast<double>();
  const bool still = rotation.isIdentity(0) && origin.isZero(0) && options.scale == 1;
  placed.reserve(source.vertices.size());
  for (const Vec3& vertex : source.vertices) {
    const Vec3 p =
        still ? vertex
              : Vec3((origin + rotation * (double{options.scale} * vertex.cast<double>())).cast<float>());
    if (!(p.cwiseAbs().maxCoeff() <= limits.maxCoordinate))
      return fmt::format(
          "vertex {} is at {} m after scaling; each coordinate must be within {:g} m of the origin: set the "
          "scale (0.01 for "
          "centimetres) or move it",
          placed.size(), shown(p), limits.maxCoordinate);
    placed.push_back(p);
  }
  return std::nullopt;
}

// Cell of the grid that finds close vertices.
struct Cell {
  std::int64_t x, y, z;
  bool operator==(const Cell&) const = default;
};

// Seeded at random, so that no mesh can be made whose cells have equal hashes.
class CellHash {
 public:
  CellHash() {
    std::random_device random;
    seed_ = std::uint64_t{random()} << 32 | random();
  }
  std::size_t operator()(const Cell& cell) const {
    std::uint64_t hash = seed_;
    for (const std::int64_t part : {cell.x, cell.y, cell.z})
      hash = mixed(hash ^ static_cast<std::uint64_t>(part));
    return hash;
  }

 private:
  // Finaliser of SplitMix64 (Steele, Lea and Flood, 2014).
  static std::uint64_t mixed(std::uint64_t value) {
    value += 0x9E3779B97F4A7C15;
    value = (value ^ value >> 30) * 0xBF58476D1CE4E5B9;
    value = (value ^ value >> 27) * 0x94D049BB133111EB;
    return value ^ value >> 31;
  }

  std::uint64_t seed_;
};

// Minimum size of a cell in metres. It keeps cell indices within 64 bits.
constexpr double kSmallestCell = 1e-9;

// For each vertex the first earlier vertex within the distance, or else itself. Cells are larger than the
// distance, so that a close vertex is usually in the same cell. The vertices of a cell are farther apart than
// the distance, so a cell has only a few, and the time is linear in the number of vertices.
std::vector<std::uint32_t> weld(const std::vector<Vec3>& positions, float distance) {
  std::vector<std::uint32_t> first(positions.size());
  std::iota(first.begin(), first.end(), 0u);
  if (distance <= 0) return first;
  const double reach = distance, cell = std::max(2 * reach, kSmallestCell);
  const auto cellOf = [&](double coordinate) {
    return static_cast<std::int64_t>(std::floor(coordinate / cell));
  };
  std::unordered_multimap<Cell, std::uint32_t, CellHash> cells;
  cells.reserve(positions.size());
  for (std::uint32_t i = 0; i < positions.size(); ++i) {
    const Eigen::Vector3d p = positions[i].cast<double>();
    std::uint32_t nearest = i;
    for (std::int64_t x = cellOf(p.x() - reach); x <= cellOf(p.x() + reach); ++x)
      for (std::int64_t y = cellOf(p.y() - reach); y <= cellOf(p.y() + reach); ++y)
        for (std::int64_t z = cellOf(p.z() - reach); z <= cellOf(p.z() + reach); ++z) {
          const auto [begin, end] = cells.equal_range({x, y, z});
          for (auto it = begin; it != end; ++it)
            if ((positions[it->second] - positions[i]).norm() <= distance)
              nearest = std::min(nearest, it->second);
        }
    first[i] = nearest;
    if (nearest == i) cells.emplace(Cell{cellOf(p.x()), cellOf(p.y()), cellOf(p.z())}, i);
  }
  return first;
}

// Spreads 21 bits to every third bit.
std::uint64_t spread(std::uint64_t x) {
  x &= (1u << 21) - 1;
  x = (x | x << 32) & 0x001F00000000FFFFull;
  x = (x | x << 16) & 0x001F0000FF0000FFull;
  x = (x | x << 8) & 0x100F00F00F00F00Full;
  x = (x | x << 4) & 0x10C30C30C30C30C3ull;
  return (x | x << 2) & 0x1249249249249249ull;
}

// Order along a Morton curve through the bounding cube. It depends on positions only, so ordering twice
// changes nothing. Vertices in the same cell of the curve keep their order.
std::vector<std::uint32_t> curveOrder(const std::vector<Vec3>& positions, std::vector<std::uint32_t> nodes) {
  Vec3 low = positions[nodes.front()], high = low;
  for (const std::uint32_t i : nodes) {
    low = low.cwiseMin(positions[i]);
    high = high.cwiseMax(positions[i]);
  }
  const double cells = ((1 << 21) - 1) / std::max(1e-30, double{(high - low).maxCoeff()});
  std::vector<std::uint64_t> keys(positions.size(), 0);
  for (const std::uint32_t i : nodes) {
    const auto along = [&](int axis) {
      return spread(static_cast<std::uint64_t>((double{positions[i][axis]} - double{low[axis]}) * cells));
    };
    keys[i] = along(0) | along(1) << 1 | along(2) << 2;
  }
  std::ranges::stable_sort(nodes, {}, [&](std::uint32_t i) { return keys[i]; });
  return nodes;
}

// Nodes and the corresponding indices of the source.
struct Numbering {
  std::vector<std::uint32_t> nodeOfVertex, vertexOfNode;
};

Numbering numberNodes(const MeshSource& source, const std::vector<Vec3>& placed, float weldDistance) {
  const std::vector<std::uint32_t> welded = weld(placed, weldDistance);
  std::vector<std::uint32_t> used;
  std::vector<bool> isUsed(placed.size(), false);
  for (const SourceFace& face : source.faces)
    for (std::uint32_t corner = 0; corner < face.cornerCount; ++corner)
      isUsed[welded[face.vertices[corner]]] = true;
  for (std::uint32_t i = 0; i < placed.size(); ++i)
    if (isUsed[i]) used.push_back(i);
  Numbering numbering{std::vector<std::uint32_t>(placed.size(), kNoNode), curveOrder(placed, used)};
  for (std::uint32_t node = 0; node < numbering.vertexOfNode.size(); ++node)
    numbering.nodeOfVertex[numbering.vertexOfNode[node]] = node;
  for (std::uint32_t i = 0; i < placed.size(); ++i)
    numbering.nodeOfVertex[i] = numbering.nodeOfVertex[welded[i]];
  return numbering;
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
            "{} are the same node; delete the face, or make weldDistance smaller than their distance",
            what());
      const float length = (positions[a] - positions[b]).norm();
      if (length < minEdge)
        return fmt::format("{} lie {:g} m apart; at least {:g} is needed: merge them, or set the scale",
                           what(), length, minEdge);
    }
  return std::nullopt;
}

// A triangle whose corners are on one line has no area, so it cannot be drawn and has no air resistance.
bool isFlat(const Vec3& a, const Vec3& b, const Vec3& c) {
  const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  return double{(b - a).cross(c - a).norm()} < 1e-5 * longest;
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
          "face {} is degenerate: its vertices {}, {} and {} lie on one line; delete it, or move one", f,
          face.vertices[i], face.vertices[j], face.vertices[k]);
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
  std::size_t free = 0;
  for (const std::size_t f : source.halves) {
    const auto refuse = [&](std::string_view why) {
      return fmt::format("faces {} and {} are not a quad: {}", f, f + 1, why);
    };
    if (f < free || f + 1 >= source.faces.size())
      return refuse(
          "a quad is a face and the next one, listed in ascending order, and no face may be in two quads");
    if (source.faces[f].cornerCount != 3 || source.faces[f + 1].cornerCount != 3)
      return refuse("its halves must be triangles");
    free = f + 2;
    const auto t =
        static_cast<std::size_t>(std::ranges::lower_bound(faceOfTriangle, f) - faceOfTriangle.begin());
    const Triangle &first = shape.triangles[t], &second = shape.triangles[t + 1];
    const auto shared = std::ranges::count_if(
        first, [&](std::uint32_t node) { return std::ranges::count(second, node) > 0; });
    if (shared != 2) return refuse("they share no edge");
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
          "the edge {} is not manifold: faces {}, {} and {} meet there; at most two may: delete one, or "
          "separate the layers",
          edge, faceOfTriangle[one.triangle], faceOfTriangle[two.triangle],
          faceOfTriangle[sides[i + 1].triangle]);
    if (one.upwards == two.upwards)
      return fmt::format(
          "faces {} and {} run the same way along the edge {}: their fronts are on different sides; flip one "
          "(in Blender: Recalculate Normals), or delete it if it is there twice",
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
        return fmt::format("vertex {} has more than {} springs: divide the faces around it",
                           vertexOfNode[node], maxNodeSprings);
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

}  // namespace

tl::expected<BuiltMesh, std::string> buildMesh(const MeshSource& source, const MeshOptions& options,
                                               const MeshLimits& limits) {
  std::vector<Vec3> placed;
  if (Problem problem = checkSizes(source, limits)) return tl::unexpected(std::move(*problem));
  if (Problem problem = checkNumbers(source)) return tl::unexpected(std::move(*problem));
  if (Problem problem = place(source, options, limits, placed)) return tl::unexpected(std::move(*problem));
  limits.cancellation.check();
  Numbering numbering = numberNodes(source, placed, options.weldDistance);
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
  if (Problem problem = checkEdges(shape, faceOfTriangle, numbering.vertexOfNode))
    return tl::unexpected(std::move(*problem));
  limits.cancellation.check();
  shape.submeshes = submeshes(source, faceOfTriangle);
  BuiltMesh built{model::makeMesh(std::move(shape), limits.cancellation), std::move(numbering.nodeOfVertex)};
  if (Problem problem = checkSprings(built.mesh, numbering.vertexOfNode, limits.maxNodeSprings))
    return tl::unexpected(std::move(*problem));
  return built;
}

}  // namespace clothstream::meshes
