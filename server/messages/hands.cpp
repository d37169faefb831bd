// SPDX-License-Identifier: MIT
// Converts joints to capsules.
#include "server/messages/hands.h"

#include <array>
#include <cmath>

#include <fmt/format.h>

#include "proto/hands/bones.h"
#include "server/messages/limits.h"

namespace clothstream::messages {
namespace {

using hands::kJoints, hands::kJointsWithoutPalm, hands::kWrist;
constexpr std::size_t kIndexProximal = 7, kMiddleProximal = 12, kLittleProximal = 22;
constexpr std::size_t kThumbBones = 3;

struct Joints {
  std::array<model::Vec3, kJoints> positions;
  std::array<float, kJoints> radii;
};

// Rotation that turns Y to the direction of the bone. X stays in the plane of the bone and `across`, so that
// a capsule that follows a hand does not spin around its axis.
model::Quaternion along(const model::Vec3& bone, const model::Vec3& across) {
  const float length = bone.norm();
  if (!(length > 0)) return model::Quaternion::Identity();
  const model::Vec3 y = bone / length;
  model::Vec3 x = across - across.dot(y) * y;
  if (!(x.norm() > 0.01f * across.norm())) return model::Quaternion::FromTwoVectors(model::Vec3::UnitY(), y);
  x.normalize();
  Eigen::Matrix3f axes;
  axes << x, y, x.cross(y);
  return model::Quaternion(axes).normalized();
}

bool readJoints(Checks& checks, const Path& path, const v1::HandJoints& message, Joints& joints) {
  const auto count = static_cast<std::size_t>(message.radii_size());
  if (count != kJoints && count != kJointsWithoutPalm)
    checks.fail(path / "radii", "",
                fmt::format("has {} elements; must have {} (OpenXR's joints) or {} (WebXR's)", count, kJoints,
                            kJointsWithoutPalm));
  checks.count(path / "positions", static_cast<std::size_t>(message.positions_size()), 3 * count, 3 * count);
  if (checks.failed()) return false;
  // Skips the palm joint, which belongs to no bone.
  const std::size_t first = kJoints - count;
  for (std::size_t i = 0; i < count; ++i) {
    const auto element = static_cast<int>(i);
    joints.radii[first + i] =
        checks.number(path.at("radii", element), message.radii(element), limits::kJointRadius);
    for (int axis = 0; axis < 3; ++axis)
      joints.positions[first + i][axis] = checks.number(
          path.at("positions", 3 * element + axis), message.positions(3 * element + axis), limits::kPosition);
  }
  for (std::size_t i = 0; i < count && !checks.failed(); ++i) {
    const float reach = (joints.positions[first + i] - joints.positions[kWrist]).norm();
    if (reach > limits::kMaxHandReach)
      checks.fail(path.at("positions", static_cast<int>(3 * i)), "",
                  fmt::format("the joint is {:g} m from the wrist; must be within {:g} m", reach,
                              limits::kMaxHandReach));
  }
  return !checks.failed();
}

}  // namespace

std::vector<model::ParticipantCollider> toBones(Checks& checks, const Path& path,
                                                const v1::HandJoints& message) {
  if (message.side() != v1::HAND_SIDE_LEFT && message.side() != v1::HAND_SIDE_RIGHT)
    checks.fail(path / "side", fmt::format("{}", static_cast<int>(message.side())),
                "must be HAND_SIDE_LEFT or HAND_SIDE_RIGHT");
  Joints joints;
  if (checks.failed() || !readJoints(checks, path, message, joints)) return {};
  const auto& at = joints.positions;
  const model::Vec3 across = at[kLittleProximal] - at[kIndexProximal];
  const model::Vec3 outOfPalm = across.cross(at[kMiddleProximal] - at[kWrist]);
  const std::uint32_t firstId = kFirstBoneId + (message.side() == v1::HAND_SIDE_RIGHT ? 32 : 0);
  std::vector<model::ParticipantCollider> bones;
  for (std::size_t i = 0; i < kHandBones; ++i) {
    const auto [from, to] = hands::kBones[i];
    const model::Vec3 bone = at[to] - at[from];
    model::ParticipantCollider& capsule = bones.emplace_back();
    capsule.id = firstId + static_cast<std::uint32_t>(i);
    capsule.pose = {.position = (at[from] + at[to]) / 2,
                    .orientation = along(bone, i < kThumbBones ? outOfPalm : across)};
    capsule.shape =
        model::Capsule{.radius = (joints.radii[from] + joints.radii[to]) / 2, .length = bone.norm()};
  }
  return bones;
}

}  // namespace clothstream::messages
