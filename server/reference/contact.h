// SPDX-License-Identifier: MIT
// Contact of a moving point with a shape, in double precision.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <memory>
#include <optional>

#include "server/model/collider.h"

namespace clothstream::reference {

using Vec3 = Eigen::Vector3d;
using Quaternion = Eigen::Quaterniond;

struct Pose {
  Vec3 position = Vec3::Zero();
  Quaternion orientation = Quaternion::Identity();
};

inline Pose toPose(const model::Pose& pose) {
  return {pose.position.cast<double>(), pose.orientation.cast<double>()};
}

// Interpolates in a straight line, and by the normalised mean of the quaternions the shorter way. `part` is
// from 0 to 1.
Pose between(const Pose& from, const Pose& to, double part);

// A collider over one substep.
struct ColliderStep {
  Pose before, after;
  Vec3 velocity = Vec3::Zero();
  // A mesh with joints at the start and at the end; null for other shapes.
  std::shared_ptr<const model::ClosedMesh> meshBefore = nullptr, meshAfter = nullptr;
  double seconds = 1;        // of the substep
  Vec3 spin = Vec3::Zero();  // axis times twice the sine of half the angle, over the substep's seconds
};

// Substep `index` of `substeps` on the way from `start` to `end`.
ColliderStep stepOf(const Pose& start, const Pose& end, std::uint32_t index, std::uint32_t substeps,
                    double tickSeconds);

// Distance of the point from the shape's surface, m (from the highest plane of shapes with planes). Negative
// inside.
double heightOver(const model::Shape& shape, const Pose& pose, const Vec3& point);

struct Contact {
  Vec3 normal;                   // out of the shape
  double depth;                  // distance by which the end of the path has to move along it
  Vec3 velocity = Vec3::Zero();  // of the surface there, relative to the collider, m/s
};

// Cloth keeps `thickness` from the surface (from the planes of shapes with planes). A path that begins
// outside meets the shape where it first enters. A path that begins inside leaves by the nearest way at its
// beginning.
std::optional<Contact> contactOf(const model::Shape& shape, double thickness, const ColliderStep& step,
                                 const Vec3& from, const Vec3& to);

}  // namespace clothstream::reference
