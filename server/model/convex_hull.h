// SPDX-License-Identifier: MIT
// Convex polyhedra, made from corners and faces and checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/model/pose.h"

namespace clothstream::model {

// Points with normal . x <= offset.
struct HalfSpace {
  Vec3 normal = Vec3::UnitY();  // length 1
  float offset = 0;             // m
};

struct ConvexHull {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> faces;  // corners, counter-clockwise seen from outside
  // The hull is the intersection of these half-spaces. Faces in one plane share a half-space. The six sides
  // of the bounding box are included: they do not change the hull. Cloth keeps a distance from every plane,
  // so they limit how far that distance extends a sharp edge.
  std::vector<HalfSpace> planes;
};

// Maximum distance of a corner from the plane of its face, or in front of any face, as a fraction of the
// hull's size.
inline constexpr double kHullTolerance = 1e-4;

struct HullProblem {
  std::optional<std::size_t> face;  // absent: the problem concerns the whole hull
  std::string text;
};

// Corners must be finite. Returns a problem if the polyhedron is not convex, not closed, flat or inside out.
// Returns a problem also if a face has fewer than three corners, an unknown or a repeated corner, or is not
// planar.
std::variant<ConvexHull, HullProblem> makeConvexHull(std::vector<Vec3> vertices,
                                                     std::vector<std::vector<std::uint32_t>> faces);

}  // namespace clothstream::model
