// SPDX-License-Identifier: MIT
// Divides the room for colliders among participants.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/messages/field_error.h"
#include "server/model/input.h"
#include "server/model/scene.h"

namespace clothstream::scene {

// Box of all nodes of a scene, m.
struct ClothBounds {
  model::Vec3 low, high;
};

// Weight of a collider: its price as a share of that of one that a third of the nodes are near. `cloth` is
// null if nothing is known about the place of the cloth.
//
// The share of nodes that a collider can be near follows from its size: a large one may be near all. A
// collider that is farther from all cloth than kFarAway weighs next to nothing.
inline constexpr double kFarWeight = 0.01, kLeastWeight = 0.05, kMostWeight = 3;
inline constexpr float kFarAway = 2;  // m
double weightOf(const model::ParticipantCollider& collider, const ClothBounds* cloth);

// Whether it is the head or a part of a hand (protocol.md).
bool isHandOrHead(const model::ParticipantCollider& collider);

// Sums of the weights of colliders.
struct ColliderLoad {
  double hands = 0, others = 0;  // hands includes the head
  bool operator==(const ColliderLoad&) const = default;
  ColliderLoad& operator+=(const ColliderLoad& other) {
    hands += other.hands;
    others += other.others;
    return *this;
  }
};
ColliderLoad loadOf(std::span<const model::ParticipantCollider> colliders, const ClothBounds* cloth);

// All surfaces of the real room in a scene: the sum of model::surfaceWork(), and their triangles.
struct SurfaceLoad {
  double searches = 0;
  std::size_t triangles = 0;
  bool operator==(const SurfaceLoad&) const = default;
};

// The largest amount that each may have if all together have `room`: one that needs less leaves the rest to
// the others. Infinite if there is room for all. Sorts the needs.
double fairShare(std::span<double> needs, double room);

// Removes each collider that no longer fits into a share, in their order. Returns whether any was removed.
bool trim(std::vector<model::ParticipantCollider>& colliders, const ColliderLoad& share,
          const ClothBounds* cloth);

// Where the room for the colliders of participants comes from. Thread-safe.
class ColliderBudget {
 public:
  virtual ~ColliderBudget() = default;
  // Room for the hands and heads of all participants together, as a sum of weights.
  virtual double roomForHands() const = 0;
  // Room for all other colliders, next to these hands.
  virtual double roomForOthers(double hands) const = 0;
  // Charges that participants move the joints of colliders of the scene, or returns why there is no room.
  [[nodiscard]] virtual messages::Result<void> chargeJoints() { return {}; }
  // Charges the local winds that participants hold, `count` together, or returns why there is no room for
  // them. There is always room for fewer than before.
  [[nodiscard]] virtual messages::Result<void> chargeWinds(std::size_t /*count*/) { return {}; }
  // Charges the surfaces of the real room that participants have, or returns why there is no room for them.
  // There is always room for fewer than before.
  [[nodiscard]] virtual messages::Result<void> chargeSurfaces(const SurfaceLoad& /*load*/) { return {}; }
  // Charges what the participants have, also beyond the room.
  virtual void chargeColliders(const ColliderLoad& load) = 0;
  // Place of the cloth after the newest tick. Returns false if there was none.
  virtual bool boundsOfCloth(ClothBounds& bounds) const = 0;
};

}  // namespace clothstream::scene
