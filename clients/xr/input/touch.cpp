// SPDX-License-Identifier: MIT
#include "clients/xr/input/touch.h"

namespace clothstream::xr {

void Touch::update(const InputSample& sample, const Pose& toScene, std::uint64_t nowUs) {
  hasHead_ = sample.hasHead && isPossible(sample.head);
  if (hasHead_) head_ = toScene * sample.head;
  for (std::size_t i = 0; i < kSides; ++i) {
    limbs_[i].update(sample.limbs[i], hasHead_ ? &sample.head : nullptr, toScene, nowUs);
    if (!limbs_[i].pressed() || limbs_[i].isNew()) grabbers_[i].release();
    used_[i] = false;
  }
}

void Touch::grab(const Touchable& cloth) {
  for (std::size_t i = 0; i < kSides; ++i)
    if (limbs_[i].isNew() && !used_[i] && grabbers_[i].take(limbs_[i], cloth, lastGrab_ + 1)) ++lastGrab_;
}

void Touch::letGo() {
  for (Grabber& grabber : grabbers_) grabber.release();
}

void Touch::slipped(std::uint32_t grabId) {
  for (Grabber& grabber : grabbers_)
    if (grabber.holds() && grabber.id() == grabId) grabber.release();
}

void Touch::leave() {
  hasHead_ = false;
  for (Limb& limb : limbs_) limb.forget();
  letGo();
}

OwnInput Touch::input() const {
  OwnInput input;
  input.hasHead = hasHead_;
  input.head = head_;
  input.headRadius = kHeadRadius;
  for (std::size_t i = 0; i < kSides; ++i) {
    const Limb& limb = limbs_[i];
    if (!limb.present()) continue;
    if (limb.kind() == LimbKind::controller) {
      cs_own_collider& sphere = input.colliders[input.colliderCount];
      sphere.shape = CS_SHAPE_SPHERE;
      Eigen::Map<Eigen::Vector3f>(sphere.position) = limb.grip().position;
      sphere.radius = kControllerRadius;
      input.colliderSides[input.colliderCount++] = limb.side();
    } else {
      input.hasHand[i] = true;
      for (std::size_t joint = 0; joint < hands::kJoints; ++joint) {
        Eigen::Map<Eigen::Vector3f>(&input.hands[i][4 * joint]) = limb.joints()[joint].position;
        input.hands[i][4 * joint + 3] = limb.joints()[joint].radius;
      }
    }
    if (grabbers_[i].holds()) input.grabs[input.grabCount++] = grabbers_[i].grab(limb);
  }
  return input;
}

}  // namespace clothstream::xr
