// SPDX-License-Identifier: MIT
// Where all colliders of a scene are from tick to tick, the scene's own and the participants'.
#pragma once

#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include <google/protobuf/repeated_ptr_field.h>

#include "clothstream/v1/session.pb.h"
#include "server/model/input.h"
#include "server/model/scene.h"
#include "server/simulation/collision/moving_collider.h"

namespace clothstream::stream {

// A collider that somebody moved faster than this (m/s), or turned by more than kMaxColliderTurn in a tick
// (the cosine of half the angle: 120 degrees), is not swept there: it appears at its new place, at rest.
inline constexpr float kMaxColliderSpeed = 30;
inline constexpr float kMaxColliderTurn = 0.5f;

// Belongs to the device's thread. The order is the same whatever the order of arrival: the scene's colliders
// as defined, then participants by number, each one's by id.
class ColliderSet {
 public:
  // At the start: simulated time 0.
  explicit ColliderSet(const model::Scene& scene);

  // All colliders of this participant. A known id moves there over the next tick, a new one appears at rest,
  // one that is missing vanishes.
  void place(std::uint64_t participant, std::span<const model::ParticipantCollider> colliders);

  // The next tick, which ends at this simulated time: all colliders, each from where it was to where it is
  // then.
  void advance(const model::Scene& scene, double endSeconds,
               std::vector<simulation::MovingCollider>& colliders);

  // Which collider is the index-th of the last advance(). Of the scene's the participant is 0 and the id
  // their place.
  struct Identity {
    std::uint64_t participant;
    std::uint32_t id;
    bool operator<(const Identity& other) const {
      return std::tie(participant, id) < std::tie(other.participant, other.id);
    }
  };
  Identity identity(std::size_t index) const;

  // Where they are now. `scene` as of the last advance().
  void write(const model::Scene& scene, google::protobuf::RepeatedPtrField<v1::ColliderState>& states) const;

 private:
  struct Held {
    std::uint64_t participant;
    model::ParticipantCollider now;
    model::Pose before;
  };

  std::vector<model::Pose> scenePoses_;
  std::vector<Held> colliders_;
};

}  // namespace clothstream::stream
