// SPDX-License-Identifier: MIT
// Colliders: solid shapes and their motion over simulated time.
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "server/model/closed_mesh.h"
#include "server/model/convex_hull.h"
#include "server/model/pose.h"

namespace clothstream::model {

// Shapes are given in the frame of their collider. Units are metres.

struct Sphere {
  float radius = 0.1f;
};

// All points within `radius` of a segment along Y, which is centred on the origin.
struct Capsule {
  float radius = 0.1f;
  float length = 0.2f;  // length of the segment
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

// Radius of a sphere around the origin of the frame that contains the shape. For a hull it contains the
// bounding box. For a plane it is infinite.
float reachOf(const Shape& shape);

// nullptr if the shape has no radius.
float* radiusOf(Shape& shape);

struct MotionKey {
  float time = 0;  // s
  Vec3 position = Vec3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

// Repeats from the first key after the last one. Times ascend from 0. Without keys the collider stays at its
// pose.
struct Motion {
  std::vector<MotionKey> keys = {};
  bool steady = false;  // constant speed between keys; otherwise slow at each key (smoothstep)
};

struct Collider {
  std::string name = {};
  Shape shape = Sphere{};
  Pose pose = {};
  float friction = 1;  // Coulomb; multiplied by the friction of the cloth
  Motion motion = {};
};

// Pose at a simulated time: from the motion, or `pose` if the motion has no keys. Orientations between two
// keys follow the shorter path, as the normalised weighted mean of the quaternions. Only + - * / floor and
// sqrt in double are used, so every machine gives the same value.
Pose poseAt(const Pose& pose, const Motion& motion, double seconds);
inline Pose poseAt(const Collider& collider, double seconds) {
  return poseAt(collider.pose, collider.motion, seconds);
}

}  // namespace clothstream::model
