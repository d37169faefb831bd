// SPDX-License-Identifier: MIT
// One side of the user in scene coordinates: a controller or a tracked hand.
#pragma once

#include <cstdint>

#include "clients/xr/input/hysteresis.h"
#include "clients/xr/input/sample.h"

namespace clothstream::xr {

enum class LimbKind : std::uint8_t { none, controller, hand };

struct Ray {
  Eigen::Vector3f origin = Eigen::Vector3f::Zero();
  Eigen::Vector3f direction = -Eigen::Vector3f::UnitZ();  // of length 1
};

// A controller that is held has priority over a hand, because runtimes also make joints of controllers. What
// is lost keeps its last pose for kHoldUs; what switches does so at once.
class Limb {
 public:
  static constexpr std::uint64_t kHoldUs = 300'000;

  explicit Limb(Side side) : side_(side) {}

  // Call once per frame. `toScene` leads from the room to the scene. `head` is the head in the room, or null
  // if it is not known; a hand without a ray of the runtime points away from the shoulder below it.
  void update(const LimbSample& sample, const Pose* head, const Pose& toScene, std::uint64_t nowUs);
  // Forgets everything, for example because the session is not visible.
  void forget();

  Side side() const { return side_; }
  // Present kind, or the last one before it was lost.
  LimbKind kind() const { return kind_; }
  bool present() const { return kind_ != LimbKind::none; }
  // Whether the headset showed it in the newest frame.
  bool seen() const { return seen_; }

  // Where it takes hold: between thumb and index finger, or the middle of a controller.
  const Pose& grip() const { return grip_; }
  bool hasRay() const { return hasRay_; }
  const Ray& ray() const { return ray_; }
  // Joints of a hand.
  const HandJoints& joints() const { return joints_; }

  // Pressed: the hand pinches, or trigger or squeeze of the controller are down. `isNew` in the frame in
  // which the press began; the press of another kind is a new one.
  bool pressed() const { return pinch_.pressed() || trigger_.pressed() || squeeze_.pressed(); }
  bool isNew() const { return isNew_; }
  // Whether the press points at something: a pinch or a trigger, not a squeeze.
  bool points() const { return pinch_.pressed() || trigger_.pressed(); }

 private:
  void become(LimbKind kind);
  bool readController(const LimbSample& sample, const Pose& toScene);
  bool readHand(const LimbSample& sample, const Pose& toScene);
  void aim(const LimbSample& sample, const Pose* head, const Pose& toScene);

  Side side_;
  LimbKind kind_ = LimbKind::none;
  bool seen_ = false, hasRay_ = false, isNew_ = false;
  std::uint64_t seenUs_ = 0;
  Pose grip_;
  Ray ray_;
  HandJoints joints_;
  Hysteresis pinch_{0.8f, 0.5f}, trigger_{0.6f, 0.4f}, squeeze_{0.6f, 0.4f};
};

}  // namespace clothstream::xr
