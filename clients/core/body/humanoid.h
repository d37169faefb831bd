// SPDX-License-Identifier: MIT
// Finds the parts of a human body in a mesh with joints.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "clients/core/body/frame.h"
#include "clients/core/wire/collider.h"

namespace clothstream::client::body {

enum class Side : std::uint8_t { left, right };
inline constexpr std::array kSides{Side::left, Side::right};

enum class BoneKind : std::uint8_t { hips, head, upperArm, forearm, hand, thigh, shin, foot };

// Bone and side that the name of a joint says. A bone of the middle has no side.
struct BoneName {
  BoneKind kind;
  std::optional<Side> side;
};
// Knows the names of this project's scenes (`left-forearm`), of Mixamo (`mixamorig:LeftForeArm`), of VRM and
// glTF (`leftLowerArm`, `J_Bip_L_LowerArm`), of Blender (`forearm.L`) and of Unreal (`lowerarm_l`). Returns
// nullopt for other names.
std::optional<BoneName> boneOf(std::string_view jointName);

// Joints of an arm or a leg, from the body outwards.
struct LimbJoints {
  std::size_t upper = 0, lower = 0;
  std::optional<std::size_t> end;  // hand or foot; a leg has one
};

// Body in its own frame: metres, y upwards, it looks along -Z, and its right side is at +X.
struct Humanoid {
  std::vector<Frame> rest;                          // of each joint
  std::vector<std::optional<std::size_t>> parents;  // of each joint; less than its own index
  Rotation toCollider;  // from this frame to the one of the collider; both have one origin
  std::size_t hips = 0, head = 0;
  std::vector<std::size_t> spine;  // from the hips to the joint below the head
  std::size_t neck = 0;            // first joint above the arms, or else the head
  std::array<LimbJoints, 2> arms;  // by Side
  std::optional<std::array<LimbJoints, 2>> legs;
  std::array<double, 2> forearms{};  // m, from the elbow to the wrist
  Point eyes;                        // between the eyes, relative to the joint of the head
  double floor = 0, height = 0;      // m; lowest vertex, and size of the body
};

// Returns nullopt if the mesh has no names of joints, or lacks hips, a head, or an arm on each side. Sides
// are those of the shape, whatever the names say: the feet, or else the names, say where the front is.
std::optional<Humanoid> findHumanoid(const Hull& mesh);

// Corners of the triangles of the mesh that the neck and what is above it do not move, for a view out of the
// head.
std::vector<std::uint32_t> trianglesBelowNeck(const Humanoid& humanoid, const Hull& mesh);

}  // namespace clothstream::client::body
