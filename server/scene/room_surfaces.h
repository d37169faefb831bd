// SPDX-License-Identifier: MIT
// Surfaces of the real rooms of participants, their share of a scene's room for triangles, and their price.
#pragma once

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "server/messages/field_error.h"
#include "server/model/pose.h"
#include "server/scene/collider_shares.h"
#include "server/scene/roles.h"
#include "server/simulation/collision/surface_table.h"

namespace clothstream::scene {

// A surface that a participant has.
struct RoomSurface {
  std::uint64_t participant = 0;
  std::uint32_t id = 0;
  simulation::PlacedSurface placed;
  std::uint64_t revision = 0;  // of the mesh; differs from that of all others of the scene
};

// Thread-safe. Endpoints and the thread that makes surfaces put them here; the device's thread takes them.
// NewestPoses says which participants there are.
class RoomSurfaces {
 public:
  // Without `budget` there is room for all surfaces. It must outlive the object.
  explicit RoomSurfaces(ColliderBudget* budget = nullptr) : budget_(budget) {}

  // The participant joins; gets another role, of which a viewer loses its surfaces; is disconnected, so that
  // its surfaces do not act until it is back; is gone.
  void add(std::uint64_t participant, Role role);
  void setRole(std::uint64_t participant, Role role);
  void withdraw(std::uint64_t participant);
  void resume(std::uint64_t participant);
  void remove(std::uint64_t participant);
  void clear();

  // A mesh of a surface that is on its way.
  struct Ticket {
    std::uint64_t participant = 0;
    std::uint32_t id = 0;
    std::uint64_t number = 0;
  };
  // The first part of a mesh has arrived, with the pose that it will have. A mesh of this surface that is not
  // complete is forgotten. Returns an error if the role is too low or if there are too many surfaces.
  [[nodiscard]] messages::Result<Ticket> begin(std::uint64_t participant, std::uint32_t id,
                                               const model::Pose& pose, const Permissions& permissions);
  // The mesh is complete, and replaces the former one. It is dropped if the participant is gone, or if
  // another mesh of this surface has begun. Returns an error, and keeps the former one, if there is no room.
  [[nodiscard]] messages::Result<void> put(const Ticket& ticket, simulation::SharedSurface table,
                                           bool twoSided, float friction);
  // Returns whether put() would use the mesh: its participant is there, and no newer mesh has begun.
  bool isAwaited(const Ticket& ticket);
  // The mesh will never be complete.
  void cancel(const Ticket& ticket);
  // Returns an error if there is no such surface.
  [[nodiscard]] messages::Result<void> move(std::uint64_t participant, std::uint32_t id,
                                            const model::Pose& pose);
  void remove(std::uint64_t participant, std::uint32_t id);
  // Removes the surfaces of the participant that are not in `ids`, which ascend.
  void removeOthers(std::uint64_t participant, std::span<const std::uint32_t> ids);

  // Triangles that the surfaces of this participant may have together.
  std::size_t roomOf(std::uint64_t participant) const;

  // Replaces `surfaces` by those that act, ordered by participant and id, and returns true, if they have
  // changed since the call that set `version`. A version of 0 always differs.
  bool take(std::uint64_t& version, std::vector<RoomSurface>& surfaces) const;
  // A surface that acts and has this mesh; nothing if it is gone.
  std::optional<RoomSurface> find(std::uint64_t participant, std::uint32_t id, std::uint64_t revision) const;

 private:
  struct Entry {
    std::uint32_t id = 0;
    std::uint64_t number = 0;                         // of the newest mesh that has begun
    std::optional<model::Pose> nextPose = {};         // of a mesh that has begun
    std::optional<simulation::PlacedSurface> placed;  // absent: no mesh is complete
    std::uint64_t revision = 0;                       // of `placed`: its `number`
  };
  struct Owner {
    std::uint64_t participant = 0;
    Role role = Role::none;
    bool present = true;
    std::vector<Entry> entries = {};  // ascending by id
  };

  // The caller of the following holds the lock. The find functions return null for what is unknown.
  Owner* findOwner(std::uint64_t participant);
  static Entry* findEntry(Owner& owner, std::uint32_t id);
  // The entry, if its newest mesh is that of the ticket and not complete.
  static Entry* findAwaiting(Owner* owner, const Ticket& ticket);
  static std::size_t trianglesOf(const Owner& owner);
  // Forgets a mesh that is not complete, and the entry if it has no other.
  static void forgetNext(Owner& owner, std::uint32_t id);
  // Triangles and surfaces that the owner may have: half of what the others leave, so that the next
  // participant finds room too, and always as many as it has.
  std::size_t roomFor(const Owner& owner) const;
  std::size_t surfaceRoomFor(const Owner& owner) const;
  // Charges the surfaces that act. Returns an error if there is no room for more than before.
  messages::Result<void> charge();
  void changed();

  ColliderBudget* const budget_;
  mutable std::mutex mutex_;
  std::vector<Owner> owners_;  // ascending by participant
  std::uint64_t newest_ = 0;   // Ticket::number
  std::uint64_t version_ = 1;
};

}  // namespace clothstream::scene
