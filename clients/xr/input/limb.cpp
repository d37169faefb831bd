// SPDX-License-Identifier: MIT
#include "clients/xr/input/limb.h"

#include <algorithm>

namespace clothstream::xr {
namespace {

constexpr std::size_t kThumbTip = 5, kIndexProximal = 7, kIndexTip = 10;
constexpr float kLargestRadius = 0.1f;  // m
// Distances between the tips of thumb and index finger at which a pinch is closed and open, m.
constexpr float kClosedAt = 0.015f, kOpenAt = 0.05f;
// Place of the shoulders in the frame of a head that looks horizontally, m; x towards the side.
constexpr float kShoulderBelow = 0.2f, kShoulderAside = 0.18f;

bool isPossible(const HandJoints& joints) {
  return std::ranges::all_of(joints, [](const HandJoint& joint) {
    return joint.position.allFinite() && joint.radius > 0 && joint.radius < kLargestRadius;
  });
}

float pinchStrength(const HandJoints& joints) {
  const float distance = (joints[kThumbTip].position - joints[kIndexTip].position).norm();
  return std::clamp((kOpenAt - distance) / (kOpenAt - kClosedAt), 0.f, 1.f);
}

}  // namespace

void Limb::update(const LimbSample& sample, const Pose* head, const Pose& toScene, std::uint64_t nowUs) {
  const LimbKind before = kind_;
  const bool wasPressed = pressed();
  isNew_ = false;
  seen_ = readController(sample, toScene) || readHand(sample, toScene);
  if (seen_) {
    seenUs_ = nowUs;
  } else if (present() && nowUs - seenUs_ > kHoldUs) {
    become(LimbKind::none);
  }
  if (!present()) return;
  if (seen_) aim(sample, head, toScene);
  isNew_ = pressed() && (!wasPressed || kind_ != before);
}

void Limb::forget() {
  become(LimbKind::none);
  seen_ = isNew_ = false;
}

// A limb that switches or is gone holds nothing.
void Limb::become(LimbKind kind) {
  if (kind == kind_) return;
  kind_ = kind;
  pinch_.release();
  trigger_.release();
  squeeze_.release();
  hasRay_ = false;
}

bool Limb::readController(const LimbSample& sample, const Pose& toScene) {
  if (!sample.hasController || !xr::isPossible(sample.grip)) return false;
  become(LimbKind::controller);
  grip_ = toScene * sample.grip;
  trigger_.update(sample.trigger);
  squeeze_.update(sample.squeeze);
  return true;
}

bool Limb::readHand(const LimbSample& sample, const Pose& toScene) {
  if (!sample.hasHand || !isPossible(sample.joints)) return false;
  become(LimbKind::hand);
  pinch_.update(pinchStrength(sample.joints));
  for (std::size_t i = 0; i < joints_.size(); ++i)
    joints_[i] = {toScene.apply(sample.joints[i].position), sample.joints[i].radius};
  grip_.position = (joints_[kThumbTip].position + joints_[kIndexTip].position) / 2;
  grip_.orientation = (toScene.orientation * sample.wrist).normalized();
  return true;
}

void Limb::aim(const LimbSample& sample, const Pose* head, const Pose& toScene) {
  hasRay_ = false;
  if (sample.hasAim && xr::isPossible(sample.aim)) {
    const Pose pose = toScene * sample.aim;
    ray_ = {pose.position, pose.forward().normalized()};
    hasRay_ = true;
  } else if (kind_ == LimbKind::hand && head) {
    const Eigen::Vector3f aside =
        Eigen::AngleAxisf(yawOf(head->orientation), Eigen::Vector3f::UnitY()) *
        Eigen::Vector3f(side_ == Side::left ? -kShoulderAside : kShoulderAside, -kShoulderBelow, 0);
    const Eigen::Vector3f shoulder = toScene.apply(head->position + aside);
    const Eigen::Vector3f way = joints_[kIndexProximal].position - shoulder;
    if (way.norm() < 0.05f) return;
    ray_ = {grip_.position, way.normalized()};
    hasRay_ = true;
  }
}

}  // namespace clothstream::xr
