// SPDX-License-Identifier: MIT
#include "server/model/shape.h"

#include <algorithm>
#include <limits>

namespace clothstream::model {
namespace {

float topRadiusOf(const Capsule& capsule) {
  return capsule.topRadius.value_or(capsule.radius);
}

}  // namespace

float slopeOf(const Capsule& capsule) {
  if (capsule.length <= 0) return 0;
  return std::clamp((topRadiusOf(capsule) - capsule.radius) / capsule.length, -kMostSlope, kMostSlope);
}

float reachOf(const Shape& shape) {
  return std::visit(ShapeVisitor{[](const Sphere& sphere) { return sphere.radius; },
                                 [](const Capsule& capsule) {
                                   return std::max(capsule.radius, topRadiusOf(capsule)) + capsule.length / 2;
                                 },
                                 [](const Plane&) { return std::numeric_limits<float>::infinity(); },
                                 [](const Box& box) { return box.size.norm() / 2; },
                                 [](const Hull& hull) {
                                   Vec3 corner = Vec3::Zero();
                                   for (const Vec3& vertex : hull->vertices)
                                     corner = corner.cwiseMax(vertex.cwiseAbs());
                                   return corner.norm();
                                 },
                                 [](const Solid& solid) { return solid->reach; }},
                    shape);
}

float largestDepth(const Shape& shape) {
  return std::visit(
      ShapeVisitor{[](const Sphere& sphere) { return sphere.radius; },
                   [](const Capsule& capsule) { return std::max(capsule.radius, topRadiusOf(capsule)); },
                   [](const Plane&) { return 0.0f; }, [](const Box& box) { return box.size.minCoeff() / 2; },
                   [](const Hull&) { return 0.0f; }, [](const Solid&) { return 0.0f; }},
      shape);
}

Shape thinned(const Shape& shape, float depth) {
  if (largestDepth(shape) <= depth) return shape;
  return std::visit(ShapeVisitor{[&](const Sphere&) -> Shape { return Sphere{depth}; },
                                 [&](Capsule capsule) -> Shape {
                                   capsule.radius = std::min(capsule.radius, depth);
                                   if (capsule.topRadius)
                                     capsule.topRadius = std::min(*capsule.topRadius, depth);
                                   return capsule;
                                 },
                                 [&](const Plane&) { return shape; },
                                 [&](Box box) -> Shape {
                                   Eigen::Index thinnest = 0;
                                   box.size.minCoeff(&thinnest);
                                   box.size[thinnest] = 2 * depth;
                                   return box;
                                 },
                                 [&](const Hull&) { return shape; }, [&](const Solid&) { return shape; }},
                    shape);
}

float* radiusOf(Shape& shape) {
  using Radius = float*;
  return std::visit(
      ShapeVisitor{[](Sphere& sphere) -> Radius { return &sphere.radius; },
                   [](Capsule& capsule) -> Radius { return &capsule.radius; },
                   [](Plane&) -> Radius { return nullptr; }, [](Box&) -> Radius { return nullptr; },
                   [](Hull&) -> Radius { return nullptr; }, [](Solid&) -> Radius { return nullptr; }},
      shape);
}

}  // namespace clothstream::model
