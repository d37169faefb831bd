// SPDX-License-Identifier: MIT
// Divides polygons into triangles.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "server/model/mesh.h"

namespace clothstream::meshes {

// Most corners of a polygon that is not convex. The time of a polygon grows with the square of its corners.
inline constexpr std::size_t kMaxConcaveCorners = 1000;

// Whether the corners of a triangle are on one line, within the precision of floats. Such a triangle has no
// area, so it cannot be drawn and has no air resistance.
bool isFlat(const model::Vec3& a, const model::Vec3& b, const model::Vec3& c);

// Divides a polygon of three or more corners, in order around it, into triangles with the same orientation.
// The result has indices of `corners`. A convex polygon becomes a strip, so that no corner gets many edges.
// Others lose one ear after the other (Eberly, "Triangulation by Ear Clipping", 2002), in the plane of
// coordinates in which the polygon is largest. The best-shaped ear is first. A polygon that crosses itself
// becomes triangles too, some of which overlap or are flat. Returns nothing if the polygon is not convex and
// has more than kMaxConcaveCorners.
std::vector<model::Triangle> triangulate(std::span<const model::Vec3> corners);

}  // namespace clothstream::meshes
