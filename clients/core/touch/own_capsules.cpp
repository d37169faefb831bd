// SPDX-License-Identifier: MIT
#include "clients/core/touch/own_capsules.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "proto/hands/bones.h"

namespace clothstream::client {
namespace {

static_assert(hands::kBones.size() == CS_HAND_BONES && hands::kJoints == CS_HAND_JOINTS);

// The Y axis of a collider's own frame. All zero means no rotation.
Vector yAxis(const float* q) {
  const float squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  if (!(squared > 0)) return {0, 1, 0};
  return (1 / squared) * Vector{2 * (q[0] * q[1] - q[3] * q[2]),
                                q[1] * q[1] + q[3] * q[3] - q[0] * q[0] - q[2] * q[2],
                                2 * (q[1] * q[2] + q[3] * q[0])};
}

// Not present for a shape that is neither a sphere nor a capsule.
Capsule capsuleOf(std::uint32_t shape, const float* position, const float* orientation, float radius,
                  float topRadius, float length) {
  if (shape != CS_SHAPE_SPHERE && shape != CS_SHAPE_CAPSULE) return {};
  const Vector half = (shape == CS_SHAPE_CAPSULE ? length / 2 : 0) * yAxis(orientation);
  const Vector centre = vectorAt(position, 0);
  const bool isTapered = shape == CS_SHAPE_CAPSULE && topRadius > 0;
  return {centre - half, centre + half, radius, isTapered ? topRadius - radius : 0};
}

bool haveOneSize(const Capsule& a, const Capsule& b) {
  constexpr float kTolerance = 0.005f;  // m; joints of a tracked hand do not keep their distances exactly
  return std::abs(a.radius - b.radius) <= kTolerance && std::abs(a.growth - b.growth) <= kTolerance &&
         std::abs(length(a.to - a.from) - length(b.to - b.from)) <= kTolerance;
}

void addBones(const std::vector<float>& joints, Capsule* to) {
  const std::size_t count = joints.size() / 4;
  if (count == 0) return;
  const std::size_t first = hands::kJoints - count;  // 1 without a palm
  for (const auto& [start, end] : hands::kBones) {
    const float* a = &joints[4 * (start - first)];
    const float* b = &joints[4 * (end - first)];
    *to++ = {vectorAt(a, 0), vectorAt(b, 0), (a[3] + b[3]) / 2};
  }
}

}  // namespace

OwnCapsules ownCapsules(const Poses& poses) {
  OwnCapsules capsules;
  const auto capsuleOfOwn = [](const cs_own_collider& own) {
    return capsuleOf(own.shape, own.position, own.orientation, own.radius, own.top_radius, own.length);
  };
  std::transform(poses.colliders.begin(), poses.colliders.end(), capsules.begin(), capsuleOfOwn);
  addBones(poses.leftHand, &capsules[CS_MAX_COLLIDERS]);
  addBones(poses.rightHand, &capsules[CS_MAX_COLLIDERS + CS_HAND_BONES]);
  if (poses.head) capsules.back() = capsuleOfOwn(*poses.head);
  return capsules;
}

std::optional<OwnCapsules> capsulesOf(std::span<const Collider> frame, std::uint64_t participantId,
                                      const OwnCapsules& sent) {
  OwnCapsules found;
  std::size_t next = 0;
  for (const Collider& collider : frame) {
    if (collider.participantId != participantId) continue;
    const Capsule capsule = capsuleOf(collider.shape, collider.position.data(), collider.orientation.data(),
                                      collider.radius, collider.topRadius, collider.length);
    if (!capsule.present()) continue;
    while (next < kOwnCapsules && !sent[next].present()) ++next;
    if (next == kOwnCapsules || !haveOneSize(capsule, sent[next])) return std::nullopt;
    found[next++] = capsule;
  }
  while (next < kOwnCapsules && !sent[next].present()) ++next;
  return next == kOwnCapsules ? std::optional(found) : std::nullopt;
}

void CapsuleHistory::add(const OwnCapsules& capsules, std::uint64_t timeUs) {
  if (!poses_.empty() && timeUs <= poses_.back().timeUs) {
    poses_.back().capsules = capsules;
    return;
  }
  poses_.push_back({timeUs, capsules});
  // One pose before the longest time remains.
  while (poses_.size() > kMost || (poses_.size() > 2 && poses_[1].timeUs + kLongestUs < timeUs))
    poses_.pop_front();
}

OwnCapsules CapsuleHistory::at(std::uint64_t timeUs) const {
  const auto after =
      std::upper_bound(poses_.begin(), poses_.end(), timeUs,
                       [](std::uint64_t time, const Posed& posed) { return time < posed.timeUs; });
  if (after == poses_.begin()) return poses_.front().capsules;
  const Posed& from = *(after - 1);
  if (after == poses_.end()) return from.capsules;
  const auto part = static_cast<float>(static_cast<double>(timeUs - from.timeUs) /
                                       static_cast<double>(after->timeUs - from.timeUs));
  OwnCapsules capsules;
  for (std::size_t i = 0; i < kOwnCapsules; ++i) {
    const Capsule &a = from.capsules[i], &b = after->capsules[i];
    if (a.present() && b.present())
      capsules[i] = {a.from + part * (b.from - a.from), a.to + part * (b.to - a.to), b.radius, b.growth};
  }
  return capsules;
}

}  // namespace clothstream::client
