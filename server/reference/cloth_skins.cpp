// SPDX-License-Identifier: MIT
#include "server/reference/cloth_skins.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <variant>

#include "server/model/cloth_skin.h"
#include "server/reference/reference_simulation.h"

namespace clothstream::reference {
namespace {

using model::Transform;

std::vector<Transform> transformsOf(const model::Skin& skin, const std::vector<model::Pose>& joints,
                                    const Pose& pose) {
  std::vector<model::Pose> rest;
  if (joints.empty()) model::compose(skin, model::restJoints(skin), rest);
  std::vector<Transform> transforms = model::jointTransforms(skin, joints.empty() ? rest : joints);
  const Eigen::Matrix3d turn = pose.orientation.normalized().toRotationMatrix();
  for (Transform& transform : transforms) {
    const Transform inner = transform;
    for (int row = 0; row < 3; ++row)
      for (std::size_t column = 0; column < 4; ++column)
        transform[4 * static_cast<std::size_t>(row) + column] =
            turn(row, 0) * inner[column] + turn(row, 1) * inner[4 + column] +
            turn(row, 2) * inner[8 + column] + (column == 3 ? pose.position[row] : 0);
  }
  return transforms;
}

Eigen::Matrix3d turnOf(const Transform& transform) {
  Eigen::Matrix3d turn;
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      turn(row, column) = transform[static_cast<std::size_t>(4 * row + column)];
  return turn;
}

// The mean of a matrix of each joint, by the weights of the vertex.
template <typename MatrixOf>
Eigen::Matrix3d meanOf(const model::VertexJoints& by, MatrixOf matrixOf) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t k = 0; k < model::kVertexJoints; ++k)
    sum += double{by.weights[k]} * matrixOf(by.joints[k]);
  return sum;
}

// The node leaves the ball behind its skinned place. `node` and `velocity` are relative to the place.
void leaveBackstop(const model::SkinLimits& limits, const Vec3& normal, const Vec3& turning, Vec3& node,
                   Vec3& velocity) {
  const Vec3 n = normal.normalized();
  const Vec3 fromCentre = node + (double{limits.backstopDistance} + double{limits.backstopRadius}) * n;
  const double length = fromCentre.norm();
  if (length >= double{limits.backstopRadius}) return;
  const Vec3 outwards = length < 1e-6 * double{limits.backstopRadius} ? n : Vec3(fromCentre / length);
  node += double{limits.backstopRadius} * outwards - fromCentre;
  const double entering = -(velocity + double{limits.backstopDistance} * turning).dot(outwards);
  if (entering > 0) velocity += entering * outwards;
}

void stayNear(const model::SkinLimits& limits, Vec3& node, Vec3& velocity) {
  const double length = node.norm();
  if (length <= double{limits.maxDistance}) return;
  const Vec3 direction = node / length;
  node = double{limits.maxDistance} * direction;
  const double leaving = velocity.dot(direction);
  if (leaving > 0) velocity -= leaving * direction;
}

}  // namespace

ClothSkins::ClothSkins(const model::Scene& scene) : scene_(scene) {
  for (std::size_t i = 0; i < scene.cloths.size(); ++i)
    if (scene.cloths[i].skin) skinned_.push_back({i, {}, {}, {}, {}});
}

void ClothSkins::begin(std::vector<ReferenceCloth>& cloths, std::span<const MovingCollider> colliders,
                       double tickSeconds) {
  for (Skinned& skinned : skinned_) {
    const model::Cloth& cloth = scene_.cloths[skinned.cloth];
    const model::Skin& skin = model::skinOf(scene_, cloth);
    const MovingCollider& collider = colliders[model::skinCollider(scene_, cloth)];
    const std::vector<Transform> start = transformsOf(skin, collider.jointsStart, collider.start),
                                 end = transformsOf(skin, collider.jointsEnd, collider.end);
    const std::vector<model::Vec3> rest = model::restPositions(cloth), normals = model::restNormals(cloth);
    ReferenceCloth& nodes = cloths[skinned.cloth];
    for (std::vector<Vec3>* list : {&skinned.start, &skinned.end, &skinned.startNormals, &skinned.endNormals})
      list->clear();
    for (std::size_t i = 0; i < rest.size(); ++i) {
      const model::VertexJoints& by = cloth.skin->joints[i];
      const auto normalBy = [&](const std::vector<Transform>& transforms) -> Vec3 {
        return (meanOf(by, [&](std::size_t joint) { return turnOf(transforms[joint]); }) *
                normals[i].cast<double>())
            .normalized();
      };
      skinned.start.push_back(model::skinned(by, start, rest[i].cast<double>()));
      skinned.end.push_back(model::skinned(by, end, rest[i].cast<double>()));
      skinned.startNormals.push_back(normalBy(start));
      skinned.endNormals.push_back(normalBy(end));
      if (collider.jumped) {
        const std::vector<Transform> before = transformsOf(skin, collider.jointsBefore, collider.before);
        const Eigen::Matrix3d turn = meanOf(by, [&](std::size_t joint) -> Eigen::Matrix3d {
          return turnOf(start[joint]) * turnOf(before[joint]).transpose();
        });
        nodes.positions()[i] = skinned.start[i] + turn * (nodes.positions()[i] -
                                                          model::skinned(by, before, rest[i].cast<double>()));
        nodes.velocities()[i] = turn * nodes.velocities()[i];
      }
      if (cloth.skin->limits[i].followsExactly())
        nodes.velocities()[i] = (skinned.end[i] - nodes.positions()[i]) / tickSeconds;
    }
  }
}

void ClothSkins::apply(std::vector<ReferenceCloth>& cloths, std::uint32_t substep, std::uint32_t substeps,
                       double tickSeconds) const {
  const double progress = static_cast<double>(substep + 1) / substeps;
  for (const Skinned& skinned : skinned_) {
    const std::vector<model::SkinLimits>& limits = scene_.cloths[skinned.cloth].skin->limits;
    ReferenceCloth& nodes = cloths[skinned.cloth];
    for (std::size_t i = 0; i < limits.size(); ++i) {
      if (nodes.inverseMasses()[i] == 0) continue;
      const Vec3 motion = skinned.end[i] - skinned.start[i], place = skinned.start[i] + progress * motion;
      const Vec3 turn = skinned.endNormals[i] - skinned.startNormals[i];
      Vec3 node = nodes.positions()[i] - place, velocity = nodes.velocities()[i] - motion / tickSeconds;
      if (limits[i].backstopRadius > 0)
        leaveBackstop(limits[i], skinned.startNormals[i] + progress * turn, turn / tickSeconds, node,
                      velocity);
      stayNear(limits[i], node, velocity);
      nodes.positions()[i] = place + node;
      nodes.velocities()[i] = motion / tickSeconds + velocity;
    }
  }
}

}  // namespace clothstream::reference
