// SPDX-License-Identifier: MIT
// What cloth collides with: solid shapes, and how they move by themselves.
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "server/model/convex_hull.h"
#include "server/model/pose.h"

namespace clothstream::model {

// Shapes lie in the collider's own frame, metres.

struct Sphere {
  float radius = 0.1f;
};

// All points within `radius` of a segment along Y, which is centred on the origin.
struct Capsule {
  float radius = 0.1f;
  float length = 0.2f;  // of the segment
};

// Everything with y <= 0.
struct Plane {};

struct Box {
  Vec3 size = Vec3::Ones();  // between opposite faces; centred on the origin
};

// Immutable, and shared by whoever has the collider. Never null.
using Hull = std::shared_ptr<const ConvexHull>;

using Shape = std::variant<Sphere, Capsule, Plane, Box, Hull>;

// For std::visit: a function for each of them.
template <typename... Visitors>
struct ShapeVisitor : Visitors... {
  using Visitors::operator()...;
};
template <typename... Visitors>
ShapeVisitor(Visitors...) -> ShapeVisitor<Visitors...>;

// A sphere of this radius about its frame's origin holds the shape (a hull: the box that holds it); infinite
// for a plane.
float reachOf(const Shape& shape);

// nullptr where the shape has no radius.
float* radiusOf(Shape& shape);

struct MotionKey {
  float time = 0;  // s
  Vec3 position = Vec3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

// From key to key and then again from the first; times ascend from 0. None: it stays at its pose.
struct Motion {
  std::vector<MotionKey> keys = {};
  bool steady = false;  // at one speed from key to key; else slow at each
};

struct Collider {
  std::string name = {};
  Shape shape = Sphere{};
  Pose pose = {};
  float friction = 1;  // Coulomb; multiplied with the cloth's
  Motion motion = {};
};

// Where something that moves by itself, or else stays at a pose, is at a simulated time. Between keys the
// orientation takes the shorter way, by the normalised mean of the quaternions. The arithmetic is + - * /
// floor and sqrt in double alone, so that every machine gives the same value.
Pose poseAt(const Pose& pose, const Motion& motion, double seconds);
inline Pose poseAt(const Collider& collider, double seconds) {
  return poseAt(collider.pose, collider.motion, seconds);
}

}  // namespace clothstream::model
