// SPDX-License-Identifier: MIT
// What participants put into a scene, on its way from the doors' threads to the scene's next tick.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/scene/input.h"
#include "server/stream/clock.h"

namespace clothstream::stream {

// What one participant does, as of its newest message; nothing once it has left.
struct Poses {
  std::uint64_t participant = 0;
  scene::ParticipantPoses now{};
  Clock::time_point arrival{};
};

// A change that was checked against the scene as all changes before it leave it.
struct AcceptedChange {
  std::uint64_t participant = 0;
  scene::ParameterChange change{};
  v1::ParameterChange message{};
};

struct Inputs {
  std::vector<AcceptedChange> changes;
  std::vector<Poses> poses;
};

// Thread-safe. Bounded: one Poses a participant, kMaxChanges changes.
class Inbox {
 public:
  static constexpr std::size_t kMaxChanges = 64;
  // Of one participant in a tick; the oldest go.
  static constexpr std::ptrdiff_t kMaxAttachmentPoses = 256;

  // Replaces what this participant posted since the last tick, but for where it put attachments that `poses`
  // says nothing of.
  void postPoses(std::uint64_t participant, scene::ParticipantPoses poses, Clock::time_point arrival);
  // False if it is full.
  [[nodiscard]] bool postChange(AcceptedChange change);
  // Of the changes that wait, what they say of the scene's colliders; the rest is dropped.
  void keepColliderChanges();

  // Those that wait, oldest first. `visit` must not call this inbox.
  void forEachChange(const std::function<void(const scene::ParameterChange&)>& visit);

  // Moves everything to `out`, whose former contents go; the two keep swapping their memory.
  void drain(Inputs& out);

 private:
  std::mutex mutex_;
  Inputs inputs_;
};

}  // namespace clothstream::stream
