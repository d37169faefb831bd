// SPDX-License-Identifier: MIT
// Shapes of colliders: what each one is, and how large. Every function that depends on the kind of a shape
// visits it with one function for each kind, so that a new kind does not compile until all of them know it.
#pragma once

#include <memory>
#include <optional>
#include <variant>

#include "server/model/closed_mesh.h"
#include "server/model/convex_hull.h"
#include "server/model/pose.h"

namespace clothstream::model {

// Shapes are given in the frame of their collider. Units are metres.

struct Sphere {
  float radius = 0.1f;
};

// The convex hull of two balls with centres on Y, `length` apart and centred on the origin. With one radius
// these are all points within it of the segment between the centres.
struct Capsule {
  float radius = 0.1f;  // of the ball at -Y
  float length = 0.2f;
  // The ball at +Y has this radius, or `radius` if it is absent. slopeOf() limits the difference.
  std::optional<float> topRadius = {};
};

// Half-space y <= 0.
struct Plane {};

struct Box {
  Vec3 size = Vec3::Ones();  // between opposite faces; centred on the origin
};

// Immutable and shared between copies of the collider. Never null.
using Hull = std::shared_ptr<const ConvexHull>;

// Body with a triangle mesh as surface. Immutable and shared like a hull. Never null.
using Solid = std::shared_ptr<const ClosedMesh>;
// A node that is deeper inside a solid than this, and than its way in the substep, is left where it is, m.
inline constexpr float kSolidDepth = 0.03f;

using Shape = std::variant<Sphere, Capsule, Plane, Box, Hull, Solid>;

// Visitor for std::visit with one function per shape.
template <typename... Visitors>
struct ShapeVisitor : Visitors... {
  using Visitors::operator()...;
};
template <typename... Visitors>
ShapeVisitor(Visitors...) -> ShapeVisitor<Visitors...>;

// Change of a capsule's radius for each metre of its length, from -kMostSlope to kMostSlope. At a slope of 1
// one ball touches the other from inside. 0 for a capsule without length.
inline constexpr float kMostSlope = 0.99f;
float slopeOf(const Capsule& capsule);

// Radius of a sphere around the origin of the frame that contains the shape. For a hull it contains the
// bounding box. For a plane it is infinite.
float reachOf(const Shape& shape);

// Depth of the point of a sphere, a capsule or a box that is deepest inside, m. 0 for other shapes.
float largestDepth(const Shape& shape);

// The shape, made thinner where a point of it is deeper inside than `depth`, m. Shapes without a
// largestDepth() stay as they are.
Shape thinned(const Shape& shape, float depth);

// nullptr if the shape has no radius.
float* radiusOf(Shape& shape);

}  // namespace clothstream::model
