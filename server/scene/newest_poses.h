// SPDX-License-Identifier: MIT
// Newest poses of each participant, its share of the room for colliders, and the room for local winds.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

#include "server/delivery/subscribers.h"
#include "server/messages/field_error.h"
#include "server/model/input.h"
#include "server/scene/collider_shares.h"
#include "server/scene/inbox.h"
#include "server/scene/roles.h"
#include "server/scene/room_surfaces.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

// Puts poses into the inbox as far as they act. Participants share the budget of colliders evenly, hands and
// heads first: colliders beyond a participant's share do not act. Local winds act in the order in which they
// begin, as far as the scene and the budget have room for them.
//
// Thread-safe. The roster says which participants there are, and calls this class while it holds its own
// lock; this class never calls the roster. Inbox, subscribers and budget are called under the lock of this
// class.
class NewestPoses {
 public:
  // Accepted range of pose times. Later times count as unknown, earlier ones as kMaxBehind.
  static constexpr std::chrono::milliseconds kMaxAhead{100}, kMaxBehind{10'000};

  // All must outlive the object. Without `budget` there is room for all colliders. `windRoom` is the number
  // of local winds that participants may hold together. `surfaces` learns which participants there are; it
  // may be null.
  NewestPoses(const delivery::Subscribers& subscribers, Inbox& inbox, ColliderBudget* budget = nullptr,
              std::size_t windRoom = model::kMaxLocalWinds, RoomSurfaces* surfaces = nullptr)
      : subscribers_(subscribers), inbox_(inbox), budget_(budget), windRoom_(windRoom), surfaces_(surfaces) {}

  // A participant joins. `posed`: the scene may have colliders or grabs of it, from a checkpoint, which has
  // no winds.
  void add(std::uint64_t participant, Role role, bool posed = false);
  // A viewer's poses are removed and forgotten. A lower role loses its winds, and sends them again if it may
  // still hold some.
  void setRole(std::uint64_t participant, Role role, Clock::time_point now);
  // Name of the collider that the participant wears; empty for none. Joints of it in poses of others do not
  // act.
  void setBody(std::uint64_t participant, const std::string& body);
  // Removes the participant's poses from the scene until resume() puts its colliders, grabs and winds back.
  void withdraw(std::uint64_t participant, Clock::time_point now);
  void resume(std::uint64_t participant, Clock::time_point now);
  // The participant is gone.
  void remove(std::uint64_t participant, Clock::time_point now);
  // All participants are gone. Poses that no tick has used are dropped.
  void clear();

  // Puts the poses of the mailbox's participant into the inbox; without a participant it does nothing.
  // `poses` is the content of `message`. Returns an error if the role is too low. Another error says so when
  // colliders begin to exceed the participant's share, when winds begin to exceed the room, or when the
  // budget begins to refuse its joints, or when they begin to be of a body that another participant wears.
  [[nodiscard]] messages::Result<void> post(const delivery::Mailbox& mailbox,
                                            const v1::ColliderPoses& message, model::ParticipantPoses poses,
                                            const Permissions& permissions, Clock::time_point arrival);

  // Divides the room for colliders again, because cloth has moved, or participants have come or gone. Call it
  // about once a second.
  void divideRoom(Clock::time_point now);

 private:
  struct Entry {
    std::uint64_t participant = 0;
    Role role = Role::none;
    std::string body;               // name of the collider that it wears
    bool posed = false;             // the scene may have colliders, grabs or winds of it
    model::ParticipantPoses poses;  // the newest, without attachments and joints
    ColliderLoad needs, uses;       // of the colliders in `poses`, while posed
    std::size_t acting = 0;         // number of them that the scene has
    bool collidersLimited = false;  // the newest message had more
    bool jointsRefused = false;     // joints of the newest message that had some
    bool bodyRefused = false;       // likewise, because another participant wears their body
    std::size_t winds = 0;          // number of its winds that the scene has
    bool windsRefused = false;      // the newest message had more
  };
  using Entries = std::vector<Entry>;

  // The caller of the following holds the lock. Returns end() if nothing is found.
  Entries::iterator find(std::uint64_t participant);
  // Puts the poses of the entry into the inbox, as far as there is room.
  void postAgain(Entry& entry, Clock::time_point now);
  void removeFromScene(Entry& entry, Clock::time_point now);
  // Largest weight that the colliders of one participant may have.
  ColliderLoad shareOfEach() const;
  // Removes colliders beyond the participant's share, and charges the others.
  void limit(Entry& entry, std::vector<model::ParticipantCollider>& colliders);
  // Removes joints of bodies that other participants wear, and returns why. `poses` is the content of
  // `message`.
  messages::Result<void> limitJoints(const Entry& entry, const v1::ColliderPoses& message,
                                     model::ParticipantPoses& poses) const;
  // Removes winds beyond the room, charges the others, and returns why it removed some.
  messages::Result<void> limitWinds(Entry& entry, std::vector<model::HeldWind>& winds);
  void charge();

  const delivery::Subscribers& subscribers_;
  Inbox& inbox_;
  ColliderBudget* const budget_;
  const std::size_t windRoom_;
  RoomSurfaces* const surfaces_;

  std::mutex mutex_;
  Entries entries_;     // in the order in which the participants joined
  ColliderLoad share_;  // of each participant's colliders; found when a need changes, and by divideRoom()
};

}  // namespace clothstream::scene
