// SPDX-License-Identifier: MIT
// Surfaces of a real room as triangle meshes, which may be open, made from vertices and triangles and
// checked.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "server/model/closed_mesh.h"
#include "server/model/pose.h"

namespace clothstream::model {

// Limits of one surface, of the surfaces of one participant, and of those of a scene.
inline constexpr std::size_t kMaxSurfaceTriangles = 50'000;
inline constexpr std::size_t kMaxSurfacesOfParticipant = 64;
inline constexpr std::size_t kMaxSceneSurfaces = 128;
inline constexpr std::size_t kMaxSceneSurfaceTriangles = 100'000;
// Largest coordinate of a vertex, m.
inline constexpr float kMaxSurfaceExtent = 100;
// A triangle is left out if its least height is below this, m. Its normal would be rounding, and the gap that
// it leaves is closed: kernels widen triangles by twice this (kSurfaceSeam).
inline constexpr double kLeastTriangleHeight = 1e-4;

// Contact keeps nodes at least this far from a surface, also those of a cloth without thickness, m. The
// rounding of places near a surface of kMaxSurfaceExtent is far below it.
inline constexpr float kLeastSurfaceDistance = 5e-4f;
// A surface with one side pushes nodes to its front that are less than this behind it, and not so near to its
// rim, where cloth that hangs down may swing below it, m.
inline constexpr float kSurfaceDepth = 0.03f;
// Speed at which a surface pushes nodes that it finds too near, or behind it, m/s.
inline constexpr float kSurfacePushSpeed = 3;
// Contacts of a node with surfaces in a substep. A node that crosses a surface after them stays where it was.
inline constexpr std::uint32_t kSurfaceRounds = 4;

// Vertices in the same place are one.
struct Surface {
  std::vector<Vec3> vertices = {};              // m; each has a triangle
  std::vector<TriangleCorners> triangles = {};  // counter-clockwise seen from the front
  // The triangles across the edges from corner 0 to 1, 1 to 2 and 2 to 0 of each triangle; at the rim, the
  // triangle itself. An edge of more than two triangles, or of two that show different sides, is a rim.
  std::vector<TriangleCorners> neighbours = {};
  // The edges at the rim, for each triangle: bit k is the edge k.
  std::vector<std::uint8_t> rims = {};
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // box, m
  double crowding = 0;                           // crowdingOf()
};

struct SurfaceProblem {
  std::optional<std::size_t> vertex, triangle;  // which one the problem concerns; neither: the whole surface
  std::string text;
};

struct MadeSurface {
  Surface surface = {};
  std::size_t dropped = 0;  // triangles that were left out: too thin, or with the same corner twice
};

// Returns a problem if there are no triangles or too many, if a vertex is not finite or beyond
// kMaxSurfaceExtent, if a triangle has an unknown corner, or if every triangle is too thin. Takes time in
// proportion to the number of triangles, apart from sorting.
std::variant<MadeSurface, SurfaceProblem> makeSurface(std::vector<Vec3> vertices,
                                                      std::vector<TriangleCorners> triangles);

}  // namespace clothstream::model
