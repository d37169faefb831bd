// SPDX-License-Identifier: MIT
// Cloth that follows the joints of a collider: where joints take its nodes, and how far nodes may leave that
// place.
#pragma once

#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "server/model/pose.h"
#include "server/model/scene.h"
#include "server/model/skin.h"

namespace clothstream::model {

// Limits of one node, metres. The backstop is a ball behind the skinned place, against the skinned normal;
// the node stays outside.
struct SkinLimits {
  static constexpr float kUnbounded = std::numeric_limits<float>::infinity();

  float maxDistance = kUnbounded;  // from the skinned place; 0: the node follows its joints exactly
  float backstopDistance = 0;      // from the skinned place to the nearest point of the ball
  float backstopRadius = 0;        // 0: no backstop

  bool followsExactly() const { return maxDistance == 0; }
  bool isBounded() const { return maxDistance < kUnbounded || backstopRadius > 0; }
  bool operator==(const SkinLimits&) const = default;
};

// Joints of the nodes of a cloth. The nodes are at their rest positions where the joints rest, in the frame
// of the collider.
struct ClothSkin {
  std::string collider;              // its shape is a Solid with a skin
  std::vector<VertexJoints> joints;  // one for each node
  std::vector<SkinLimits> limits;    // one for each node
  // By complete().
  SkinBounds bounds = {};                        // of the rest positions
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // box of the start positions
};

// Sets what follows from the shape of the cloth and the collider.
void complete(ClothSkin& skin, const Cloth& cloth, const Collider& collider);

// Index of the collider whose joints the cloth follows. The cloth must have a skin.
std::size_t skinCollider(const Scene& scene, const Cloth& cloth);
// The joints of that collider.
const Skin& skinOf(const Scene& scene, const Cloth& cloth);

// Places to which joints take the nodes. `joints` has the poses of the joints in the frame of the collider.
std::vector<Eigen::Vector3d> skinnedPlaces(const Cloth& cloth, const Skin& skin, const Pose& collider,
                                           std::span<const Pose> joints);

// Unit normals of the nodes at rest: the mean of the unit normals of the triangles around a node, by their
// angles there.
std::vector<Vec3> restNormals(const Cloth& cloth);

// Positions of the nodes at simulated time 0, in the scene or relative to a point: the skinned places if the
// cloth has a skin, else the rest positions.
std::vector<Vec3> startPositions(const Scene& scene, const Cloth& cloth);
std::vector<Vec3> startPositions(const Scene& scene, const Cloth& cloth, const Vec3& origin);
// Velocities of the nodes at simulated time 0: that of the skinned place in the first tick, unless it jumps.
// 0 for nodes that are pinned, and for cloth without a skin.
std::vector<Vec3> startVelocities(const Scene& scene, const Cloth& cloth);

}  // namespace clothstream::model
