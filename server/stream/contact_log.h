// SPDX-License-Identifier: MIT
// When colliders begin and end to touch cloth.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <tuple>

#include <google/protobuf/repeated_ptr_field.h>

#include "clothstream/v1/session.pb.h"
#include "server/model/scene.h"
#include "server/simulation/collision/moving_collider.h"
#include "server/stream/collider_set.h"

namespace clothstream::stream {

// Belongs to the device's thread.
class ContactLog {
 public:
  // Seconds without a touch after which a contact has ended: cloth that hops on a collider touches it all the
  // time.
  static constexpr double kApart = 0.05;

  void want(std::uint64_t participant, bool wants);
  // Whether somebody wants to know.
  bool wanted() const { return !wanting_.empty(); }

  // `contacts` of the tick that is complete, whose colliders are those of `colliders`.
  void addEvents(std::uint64_t tick, const model::Scene& scene, const ColliderSet& colliders,
                 std::span<const simulation::ContactStatus> contacts,
                 google::protobuf::RepeatedPtrField<v1::ContactEvent>& events);

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

  std::set<std::uint64_t> wanting_;
  std::map<Pair, Contact> contacts_;
};

}  // namespace clothstream::stream
