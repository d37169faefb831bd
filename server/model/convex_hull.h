// SPDX-License-Identifier: MIT
// A convex polyhedron from its corners and faces, and what is wrong with one that is none.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/model/pose.h"

namespace clothstream::model {

// The points with normal . x <= offset.
struct HalfSpace {
  Vec3 normal = Vec3::UnitY();  // of length 1
  float offset = 0;             // m
};

struct ConvexHull {
  std::vector<Vec3> vertices;
  std::vector<std::vector<std::uint32_t>> faces;  // corners, counter-clockwise seen from outside
  // Whose intersection it is; faces in one plane share theirs. With them, and changing nothing, the sides of
  // the box that holds it: where cloth keeps its distance from the planes, they cut off what sharp edges
  // would grow.
  std::vector<HalfSpace> planes;
};

// How far a corner may lie off the plane of a face, or in front of it, in parts of the hull's size.
inline constexpr double kHullTolerance = 1e-4;

struct HullProblem {
  std::optional<std::size_t> face;  // none: it is of the hull as a whole
  std::string text;
};

// Corners must be finite. A problem where it is not convex, not closed, flat, inside out, or a face has fewer
// than three corners, names one that is not there or one twice, or is not plane.
std::variant<ConvexHull, HullProblem> makeConvexHull(std::vector<Vec3> vertices,
                                                     std::vector<std::vector<std::uint32_t>> faces);

}  // namespace clothstream::model
