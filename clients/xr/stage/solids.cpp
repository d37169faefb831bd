// SPDX-License-Identifier: MIT
#include "clients/xr/stage/solids.h"

#include <array>
#include <cstdlib>
#include <cstring>

#include "proto/hands/bones.h"

namespace clothstream::xr {
namespace {

// Colliders are drawn slightly smaller, because triangles between nodes that touch a shape cut into it.
constexpr float kShrink = 0.985F;
constexpr float kPlaneReach = 4;  // m; half the edge of what is drawn of a plane
constexpr float kRayRadius = 0.0015F;

// Colours that differ in hue and in brightness.
constexpr std::array<std::uint32_t, 8> kColours{0x4f9bd9, 0xe08a4a, 0x6fb56a, 0xc779b8,
                                                0xd9c04f, 0x5fc4bd, 0xd96a6a, 0x8f86dd};
constexpr std::uint32_t kVisor = 0x15171c, kYields = 0xff3b1f;

// Shape of a collider that is no hull.
bool shapeOf(const cs_collider& collider, float shrink, Solid& solid) {
  solid.pose = poseOf(collider);
  switch (collider.shape) {
    case CS_SHAPE_SPHERE:
      solid.radius = solid.topRadius = shrink * collider.radius;
      return true;
    case CS_SHAPE_CAPSULE:
      solid.radius = shrink * collider.radius;
      solid.topRadius = shrink * collider.top_radius;
      solid.length = collider.length;
      return true;
    case CS_SHAPE_BOX:
      solid.kind = SolidKind::kBox;
      solid.size = shrink * Eigen::Vector3f(collider.size[0], collider.size[1], collider.size[2]);
      return true;
    case CS_SHAPE_PLANE:
      solid.kind = SolidKind::kPlane;
      solid.size = Eigen::Vector3f::Constant(2 * kPlaneReach);
      return true;
    default:
      return false;
  }
}

}  // namespace

Pose poseOf(const cs_collider& collider) {
  const float* q = collider.orientation;
  return {Eigen::Vector3f(collider.position[0], collider.position[1], collider.position[2]),
          Eigen::Quaternionf(q[3], q[0], q[1], q[2]).normalized()};
}

Colour colourOf(std::uint64_t participant) {
  return fromSrgb(kColours[participant % kColours.size()]);
}

bool isHead(const cs_collider& collider) {
  if (collider.participant_id == 0) return false;
  return std::strtoull(collider.name, nullptr, 10) == CS_HEAD_ID;
}

void addSceneCollider(const cs_collider& collider, std::vector<Solid>& out) {
  Solid solid;
  if (!shapeOf(collider, kShrink, solid)) return;
  switch (collider.shape) {
    case CS_SHAPE_SPHERE:
      solid.substance = Substance::kCeramic;
      solid.colour = fromSrgb(0xd5cdbd);
      solid.roughness = 0.16F;
      solid.reflection = 0.5F;
      break;
    case CS_SHAPE_CAPSULE:
      solid.substance = Substance::kWood;
      solid.colour = fromSrgb(0x6e4a2f);
      solid.roughness = 0.45F;
      solid.reflection = 0.4F;
      break;
    case CS_SHAPE_BOX:
      solid.substance = Substance::kPlaster;
      solid.colour = fromSrgb(0xcfc8bb);
      solid.roughness = 0.8F;
      solid.reflection = 0.05F;
      break;
    default:
      solid.substance = Substance::kPlaster;
      solid.colour = fromSrgb(0xb7b0a4);
      solid.roughness = 0.8F;
      solid.reflection = 0;
      // Other shapes are smaller, so a plane is lower. This also avoids flicker with a floor at the same
      // height.
      solid.pose.position = solid.pose.apply({0, -0.002F, 0});
      break;
  }
  out.push_back(solid);
}

void addParticipantCollider(const cs_collider& collider, const Colour& colour, float opacity,
                            std::vector<Solid>& out) {
  Solid solid;
  if (!shapeOf(collider, 1, solid) || solid.kind == SolidKind::kPlane) return;
  solid.colour = collider.yields != 0 ? fromSrgb(kYields) : colour;
  solid.opacity = opacity;
  out.push_back(solid);
  const bool isTurned = solid.pose.orientation.vec().squaredNorm() > 0;
  if (!isHead(collider) || !isTurned) return;
  // A dark visor on the front of the head, which looks along -Z of its frame.
  const float radius = collider.radius;
  solid.pose.position = solid.pose.apply(radius * Eigen::Vector3f(0, 0.12F, -0.4F));
  solid.stretch = {1, 0.4F, 0.72F};
  solid.colour = fromSrgb(kVisor);
  solid.roughness = 0.2F;
  solid.reflection = 0.8F;
  out.push_back(solid);
}

void addRod(const Eigen::Vector3f& from, const Eigen::Vector3f& to, float radius, float toRadius,
            const Solid& look, std::vector<Solid>& out) {
  Solid rod = look;
  rod.kind = SolidKind::kCapsule;
  const Eigen::Vector3f along = to - from;
  rod.length = along.norm();
  rod.radius = radius;
  rod.topRadius = toRadius;
  rod.pose.position = 0.5F * (from + to);
  rod.pose.orientation = rod.length > 0 ? Eigen::Quaternionf::FromTwoVectors(Eigen::Vector3f::UnitY(), along)
                                        : Eigen::Quaternionf::Identity();
  out.push_back(rod);
}

void addHand(const float* joints, const Colour& colour, bool hidesOnly, std::vector<Solid>& out) {
  Solid look;
  look.colour = colour;
  look.roughness = 0.7F;
  look.hidesOnly = hidesOnly;
  const auto place = [&](std::size_t joint) {
    return Eigen::Vector3f(joints[4 * joint], joints[4 * joint + 1], joints[4 * joint + 2]);
  };
  const auto bone = [&](std::size_t from, std::size_t to) {
    addRod(place(from), place(to), joints[4 * from + 3], joints[4 * to + 3], look, out);
  };
  for (const hands::Bone& each : hands::kBones) bone(each.from, each.to);
  // The sides of the palm, which are no colliders: from the wrist to the first joint of each finger.
  for (const std::size_t joint : {std::size_t{2}, std::size_t{6}, std::size_t{16}, std::size_t{21}})
    bone(hands::kWrist, joint);
}

void addRay(const Eigen::Vector3f& from, const Eigen::Vector3f& to, const Colour& colour,
            std::vector<Solid>& out) {
  Solid look;
  look.substance = Substance::kGlowing;
  look.colour = colour;
  look.opacity = 0.6F;
  addRod(from, to, kRayRadius, kRayRadius, look, out);
}

}  // namespace clothstream::xr
