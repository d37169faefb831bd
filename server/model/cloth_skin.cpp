// SPDX-License-Identifier: MIT
#include "server/model/cloth_skin.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <variant>

#include "server/model/closed_mesh.h"
#include "server/model/mesh.h"
#include "server/model/origin.h"

namespace clothstream::model {

std::size_t skinCollider(const Scene& scene, const Cloth& cloth) {
  assert(cloth.skin);
  const auto found = std::ranges::find(scene.colliders, cloth.skin->collider, &Collider::name);
  assert(found != scene.colliders.end());
  return static_cast<std::size_t>(found - scene.colliders.begin());
}

const Skin& skinOf(const Scene& scene, const Cloth& cloth) {
  return *std::get<Solid>(scene.colliders[skinCollider(scene, cloth)].shape)->skin;
}

std::vector<Vec3> restNormals(const Cloth& cloth) {
  const std::vector<Vec3> positions = restPositions(cloth, originOf(cloth));
  std::vector<Eigen::Vector3d> sums(positions.size(), Eigen::Vector3d::Zero());
  for (const Triangle& triangle : clothTriangles(cloth)) {
    std::array<Eigen::Vector3d, 3> corners;
    for (std::size_t i = 0; i < 3; ++i) corners[i] = positions[triangle[i]].cast<double>();
    const Eigen::Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (std::size_t i = 0; i < 3; ++i)
      sums[triangle[i]] += arcCosine((corners[(i + 1) % 3] - corners[i])
                                         .normalized()
                                         .dot((corners[(i + 2) % 3] - corners[i]).normalized())) *
                           normal;
  }
  std::vector<Vec3> normals;
  normals.reserve(sums.size());
  // Where triangles around a node face each other, it has no normal, and a backstop there does nothing.
  for (const Eigen::Vector3d& sum : sums) {
    const double length = sum.norm();
    normals.push_back(length > 1e-6 ? Vec3((sum / length).cast<float>()) : Vec3(Vec3::Zero()));
  }
  return normals;
}

namespace {

std::vector<Eigen::Vector3d> placesOf(const ClothSkin& clothSkin, const Cloth& cloth, const Skin& skin,
                                      const Pose& collider, std::span<const Pose> joints) {
  std::vector<Transform> transforms(joints.size());
  jointTransforms(inverseRests(skin), joints, collider, transforms);
  std::vector<Eigen::Vector3d> places;
  places.reserve(cloth.nodeCount());
  for (const Vec3& rest : restPositions(cloth))
    places.push_back(skinned(clothSkin.joints[places.size()], transforms, rest.cast<double>()));
  return places;
}

// Places of the nodes at a simulated time, relative to a point.
std::vector<Eigen::Vector3d> placesAt(double seconds, const ClothSkin& clothSkin, const Cloth& cloth,
                                      const Collider& collider, const Vec3& origin) {
  const Skin& skin = *std::get<Solid>(collider.shape)->skin;
  std::vector<Pose> local, joints;
  jointsAt(skin, seconds, local);
  compose(skin, local, joints);
  Pose pose = poseAt(collider, seconds);
  pose.position -= origin;
  return placesOf(clothSkin, cloth, skin, pose, joints);
}

std::vector<Vec3> startPlaces(const ClothSkin& clothSkin, const Cloth& cloth, const Collider& collider,
                              const Vec3& origin) {
  std::vector<Vec3> positions;
  positions.reserve(cloth.nodeCount());
  for (const Eigen::Vector3d& place : placesAt(0, clothSkin, cloth, collider, origin))
    positions.emplace_back(place.cast<float>());
  return positions;
}

}  // namespace

void complete(ClothSkin& skin, const Cloth& cloth, const Collider& collider) {
  skin.bounds =
      skinBounds(skin.joints, std::get<Solid>(collider.shape)->skin->joints.size(), restPositions(cloth));
  const std::vector<Vec3> places = startPlaces(skin, cloth, collider, Vec3::Zero());
  skin.low = skin.high = places[0];
  for (const Vec3& place : places) {
    skin.low = skin.low.cwiseMin(place);
    skin.high = skin.high.cwiseMax(place);
  }
}

std::vector<Vec3> startPositions(const Scene& scene, const Cloth& cloth, const Vec3& origin) {
  if (!cloth.skin) return restPositions(cloth, origin);
  return startPlaces(*cloth.skin, cloth, scene.colliders[skinCollider(scene, cloth)], origin);
}

std::vector<Eigen::Vector3d> skinnedPlaces(const Cloth& cloth, const Skin& skin, const Pose& collider,
                                           std::span<const Pose> joints) {
  return placesOf(*cloth.skin, cloth, skin, collider, joints);
}

std::vector<Vec3> startVelocities(const Scene& scene, const Cloth& cloth) {
  std::vector<Vec3> velocities(cloth.nodeCount(), Vec3::Zero());
  if (!cloth.skin) return velocities;
  const Collider& collider = scene.colliders[skinCollider(scene, cloth)];
  const std::vector<std::uint8_t> pinned = pinnedNodes(cloth);
  const auto places = placesAt(0, *cloth.skin, cloth, collider, Vec3::Zero()),
             later = placesAt(scene.tickSeconds(), *cloth.skin, cloth, collider, Vec3::Zero());
  for (std::size_t node = 0; node < velocities.size(); ++node) {
    const Eigen::Vector3d velocity = (later[node] - places[node]) * scene.simulationRate;
    if (pinned[node] == 0 && velocity.norm() < kMaxAttachmentSpeed) velocities[node] = velocity.cast<float>();
  }
  return velocities;
}

std::vector<Vec3> startPositions(const Scene& scene, const Cloth& cloth) {
  return cloth.skin ? startPositions(scene, cloth, Vec3::Zero()) : restPositions(cloth);
}

}  // namespace clothstream::model
