// SPDX-License-Identifier: MIT
#include "server/meshes/repair.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "server/meshes/sheets.h"
#include "server/meshes/triangulation.h"

namespace clothstream::meshes {
namespace {

using model::Triangle;
using model::Vec3;

// Steps 1 and 2 of repairMesh(), without duplicates.
class TriangleMaker {
 public:
  TriangleMaker(const MeshSource& source, const std::vector<Vec3>& placed,
                const std::vector<std::uint32_t>& welded, Repairs& repairs)
      : source_(source), placed_(placed), welded_(welded), repairs_(repairs) {}

  // Returns an error text.
  std::optional<std::string> make(const model::Cancellation& cancellation) {
    constexpr std::size_t kFacesBetweenChecks = 65'536;
    triangles_.reserve(source_.faces.size());
    auto half = source_.halves.begin();
    for (std::uint32_t f = 0; f < source_.faces.size(); ++f) {
      if (f % kFacesBetweenChecks == 0) cancellation.check();
      const std::size_t first = triangles_.size();
      const bool isSecondHalf = half != source_.halves.begin() && *(half - 1) + 1 == f;
      if (auto problem = addFace(f)) return problem;
      if (isSecondHalf && triangles_.size() > first && first > 0 && triangles_[first - 1].face == f - 1)
        triangles_[first - 1].isFirstHalf = true;
      if (half != source_.halves.end() && *half == f) ++half;
    }
    return std::nullopt;
  }

  std::vector<SheetTriangle>& triangles() { return triangles_; }

 private:
  std::optional<std::string> addFace(std::uint32_t f) {
    const SourceFace& face = source_.faces[f];
    if (face.cornerCount == 4 && addQuad(f)) return std::nullopt;
    corners_.clear();
    for (std::uint32_t i = 0; i < face.cornerCount; ++i) {
      const SourceCorner corner = source_.cornerOf(face, i);
      corners_.push_back({welded_[corner.vertex], corner.uv});
    }
    // Neighbouring corners with one node are one corner.
    const auto isSame = [](const SourceCorner& a, const SourceCorner& b) { return a.vertex == b.vertex; };
    corners_.erase(std::ranges::unique(corners_, isSame).begin(), corners_.end());
    while (corners_.size() > 1 && isSame(corners_.front(), corners_.back())) corners_.pop_back();
    bool isAdded = false;
    if (corners_.size() >= 3) {
      positions_.clear();
      for (const SourceCorner& corner : corners_) positions_.push_back(placed_[corner.vertex]);
      const std::vector<Triangle> parts = triangulate(positions_);
      if (parts.empty())
        return fmt::format(
            "face {} has {} corners and is not convex; at most {} can be repaired: triangulate it "
            "when you export",
            f, face.cornerCount, kMaxConcaveCorners);
      for (const Triangle& part : parts) isAdded = add(f, part) || isAdded;
    }
    if (!isAdded) ++repairs_.droppedFaces;
    if (isAdded && face.cornerCount != 3) ++repairs_.triangulatedFaces;
    return std::nullopt;
  }

  // Adds the triangle of three corners unless it has no area.
  bool add(std::uint32_t f, const Triangle& part) {
    const auto& [a, b, c] = part;
    const SourceCorner &i = corners_[a], &j = corners_[b], &k = corners_[c];
    if (i.vertex == j.vertex || j.vertex == k.vertex || k.vertex == i.vertex) return false;
    if (isFlat(placed_[i.vertex], placed_[j.vertex], placed_[k.vertex])) return false;
    triangles_.push_back({{i.vertex, j.vertex, k.vertex}, {i.uv, j.uv, k.uv}, f, false});
    return true;
  }

  // Divides a convex quad along its shorter diagonal. Between equal diagonals the lowest node decides, so
  // that a quad that is there twice has the same triangles. Returns false if it is not convex.
  bool addQuad(std::uint32_t f) {
    const SourceFace& face = source_.faces[f];
    std::array<std::uint32_t, 4> nodes = {};
    for (std::size_t i = 0; i < 4; ++i) nodes[i] = welded_[face.vertices[i]];
    const auto at = [&](std::size_t i) -> const Vec3& { return placed_[nodes[i]]; };
    const float one = (at(0) - at(2)).squaredNorm(), two = (at(1) - at(3)).squaredNorm();
    const auto lowest = static_cast<std::size_t>(std::ranges::min_element(nodes) - nodes.begin());
    const bool fromFirst = one < 0.9999f * two || (two >= 0.9999f * one && lowest % 2 == 1);
    const Triangle first = fromFirst ? Triangle{0, 1, 2} : Triangle{0, 1, 3};
    const Triangle second = fromFirst ? Triangle{0, 2, 3} : Triangle{1, 2, 3};
    const auto normal = [&](const Triangle& t) { return (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])); };
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = i + 1; j < 4; ++j)
        if (nodes[i] == nodes[j]) return false;
    for (const Triangle& t : {first, second})
      if (isFlat(at(t[0]), at(t[1]), at(t[2]))) return false;
    if (normal(first).dot(normal(second)) <= 0) return false;
    for (const Triangle& t : {first, second}) {
      SheetTriangle& triangle = triangles_.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) triangle.nodes[i] = nodes[t[i]], triangle.uvs[i] = face.uvs[t[i]];
      triangle.face = f;
    }
    triangles_[triangles_.size() - 2].isFirstHalf = true;
    return true;
  }

  const MeshSource& source_;
  const std::vector<Vec3>& placed_;
  const std::vector<std::uint32_t>& welded_;
  Repairs& repairs_;
  std::vector<SheetTriangle> triangles_;
  std::vector<SourceCorner> corners_;  // of the current face, with nodes as vertices
  std::vector<Vec3> positions_;
};

// Drops each triangle that has the nodes of an earlier one.
void dropDuplicates(std::vector<SheetTriangle>& triangles, Repairs& repairs) {
  const auto key = [&](std::uint32_t t) {
    Triangle nodes = triangles[t].nodes;
    std::ranges::sort(nodes);
    return std::pair(nodes, t);
  };
  std::vector<std::pair<Triangle, std::uint32_t>> keys;
  keys.reserve(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) keys.push_back(key(t));
  std::ranges::sort(keys);
  std::vector<bool> isDropped(triangles.size(), false);
  for (std::size_t i = 1; i < keys.size(); ++i)
    if (keys[i].first == keys[i - 1].first) isDropped[keys[i].second] = true;
  std::size_t kept = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (isDropped[t]) {
      ++repairs.droppedDuplicates;
      continue;
    }
    triangles[kept] = triangles[t];
    if (t + 1 < triangles.size() && isDropped[t + 1]) triangles[kept].isFirstHalf = false;
    ++kept;
  }
  triangles.resize(kept);
}

MeshSource toSource(const MeshSource& before, const std::vector<SheetTriangle>& triangles) {
  MeshSource source;
  source.uvs = before.uvs;
  source.faces.reserve(triangles.size());
  for (const SheetTriangle& triangle : triangles) {
    if (triangle.isFirstHalf) source.halves.push_back(source.faces.size());
    SourceFace& face = source.faces.emplace_back();
    std::ranges::copy(triangle.nodes, face.vertices.begin());
    std::ranges::copy(triangle.uvs, face.uvs.begin());
  }
  for (const MeshSource::Part& part : before.parts) {
    const auto first = std::ranges::lower_bound(triangles, part.firstFace, {}, &SheetTriangle::face);
    source.parts.push_back({part.name, static_cast<std::size_t>(first - triangles.begin())});
  }
  return source;
}

}  // namespace

tl::expected<RepairedMesh, MeshError> repairMesh(const MeshSource& source, const std::vector<Vec3>& placed,
                                                 const std::vector<std::uint32_t>& welded,
                                                 const MeshLimits& limits, Repairs& repairs) {
  TriangleMaker maker(source, placed, welded, repairs);
  if (auto problem = maker.make(limits.cancellation)) return tl::unexpected(MeshError(std::move(*problem)));
  std::vector<SheetTriangle> triangles = std::move(maker.triangles());
  dropDuplicates(triangles, repairs);
  if (triangles.empty())
    return tl::unexpected(
        MeshError("has no face with an area, so nothing is left after the repair: set the "
                  "scale, or check the file"));
  limits.cancellation.check();
  RepairedMesh repaired;
  repaired.placed = placed;
  repaired.origin.resize(placed.size());
  std::iota(repaired.origin.begin(), repaired.origin.end(), 0u);
  if (!separateSheets(triangles, repaired.placed, repaired.origin, limits.maxVertices, limits.cancellation,
                      repairs))
    return tl::unexpected(MeshError(
        fmt::format("has more than {} vertices once its edges are split; at most {} are allowed: simplify it",
                    limits.maxVertices, limits.maxVertices),
        true));
  repaired.source = toSource(source, triangles);
  return repaired;
}

}  // namespace clothstream::meshes
