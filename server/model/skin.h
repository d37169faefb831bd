// SPDX-License-Identifier: MIT
// Joints that move the vertices of a closed mesh: linear blend skinning.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "server/model/pose.h"

namespace clothstream::model {

struct Joint {
  std::string name;
  std::optional<std::uint32_t> parent;  // less than its own index; absent: the frame of the collider
  Pose rest;                            // relative to the parent
};

// Poses of all joints relative to their parents at one time of an animation.
struct JointKey {
  float time = 0;  // s
  std::vector<Pose> joints;
};

inline constexpr std::size_t kVertexJoints = 4;
inline constexpr std::size_t kMaxJoints = 128;  // of a skin

struct VertexJoints {
  std::array<std::uint8_t, kVertexJoints> joints{};
  std::array<float, kVertexJoints> weights{};  // their sum is 1
};

struct Skin {
  std::vector<Joint> joints;
  std::vector<VertexJoints> vertices;  // one for each vertex of the mesh
  // The animation repeats from the first key after the last one. Times ascend from 0. Without keys the joints
  // rest.
  std::vector<JointKey> keys;
};

// Poses of the joints in the frame of the collider, from poses relative to their parents. Only + - * / and
// sqrt in double are used, so every machine gives the same values. Allocates nothing if `poses` has room.
void compose(const Skin& skin, std::span<const Pose> local, std::vector<Pose>& poses);
// `poses` has as many elements as `local`.
void compose(const Skin& skin, std::span<const Pose> local, std::span<Pose> poses);
// The pose that is this part of the way from one to another, 0 to 1. It turns the shorter way.
Pose between(const Pose& a, const Pose& b, double part);
// Poses at rest and at a simulated time of the animation, relative to the parents.
std::vector<Pose> restJoints(const Skin& skin);
void jointsAt(const Skin& skin, double seconds, std::vector<Pose>& local);

// Rotation and translation of points: row-major, three rows of four numbers.
using Transform = std::array<double, 12>;

// Rotation, as a quaternion x y z w of length 1, and position.
struct JointFrame {
  std::array<double, 4> rotation;
  std::array<double, 3> position;
};
// The frame of the collider at rest, seen from each joint.
std::vector<JointFrame> inverseRests(const Skin& skin);
// How each joint moves the points of the mesh from its rest to a pose in the frame of the collider. All three
// have one element for each joint.
void jointTransforms(std::span<const JointFrame> inverseRests, std::span<const Pose> poses,
                     std::span<Transform> transforms);
std::vector<Transform> jointTransforms(const Skin& skin, std::span<const Pose> poses);
// The same to where the collider is at `frame`.
void jointTransforms(std::span<const JointFrame> inverseRests, std::span<const Pose> poses, const Pose& frame,
                     std::span<Transform> transforms);
Eigen::Vector3d transformed(const Transform& transform, const Eigen::Vector3d& point);

// Bounds of the vertices that joints move.
struct SkinBounds {
  struct Box {
    Vec3 low, high;
  };
  // Box of the vertices that each joint moves, at rest. Empty (low above high) if there are none.
  std::vector<Box> boxes;
};
SkinBounds skinBounds(std::span<const VertexJoints> joints, std::size_t jointCount,
                      std::span<const Vec3> vertices);
// Radius of a sphere around the origin that contains all vertices while they move in straight lines between
// two poses, and the farthest of these moves, m. A vertex is in the convex hull of the places that its joints
// give it.
struct SkinMotion {
  float reach = 0, farthest = 0;
};
SkinMotion motionBetween(const SkinBounds& bounds, std::span<const Transform> start,
                         std::span<const Transform> end);

// The vertex that a skin moves, in double precision.
Eigen::Vector3d skinned(const VertexJoints& vertex, std::span<const Transform> transforms,
                        const Eigen::Vector3d& point);

}  // namespace clothstream::model
