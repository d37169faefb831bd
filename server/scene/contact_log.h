// SPDX-License-Identifier: MIT
// Detects when colliders begin and stop touching cloth.
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <tuple>

#include "server/delivery/wire_types.h"
#include "server/model/scene.h"
#include "server/scene/collider_set.h"
#include "server/simulation/collision/moving_collider.h"

namespace clothstream::scene {

// Belongs to the device's thread.
class ContactLog {
 public:
  // Seconds without touch after which a contact has ended. Cloth that bounces on a collider therefore counts
  // as one contact.
  static constexpr double kApart = 0.05;

  // Adds the contacts that began and ended in a complete tick. `colliders` is the set of that tick.
  void addEvents(std::uint64_t tick, const model::Scene& scene, const ColliderSet& colliders,
                 std::span<const simulation::ContactStatus> contacts, v1::TickEvents& events);

 private:
  struct Pair {
    ColliderSet::Identity collider;
    std::uint32_t cloth;
    bool operator<(const Pair& other) const {
      return std::tie(collider, cloth) < std::tie(other.collider, other.cloth);
    }
  };
  struct Contact {
    std::uint64_t begun, touched;  // ticks
    double impulse;
  };

  std::map<Pair, Contact> contacts_;
};

}  // namespace clothstream::scene
