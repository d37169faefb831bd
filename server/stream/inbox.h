// SPDX-License-Identifier: MIT
// What participants put into a scene, on its way from the endpoints' threads to the scene's next tick.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/model/input.h"
#include "server/stream/clock.h"

namespace clothstream::stream {

// When poses were true.
struct PoseTime {
  std::optional<Clock::time_point> trueAt = {};  // none: not known
  std::uint64_t clientTimeUs = 0;                // the client's own clock
};

struct TimedPoses {
  model::ParticipantPoses poses{};
  Clock::time_point arrival{};
  PoseTime time = {};
};

// What one participant does, as of its newest message; nothing once it has left. With times also what it said
// since the last tick before that, oldest first, without attachments.
struct Poses {
  std::uint64_t participant = 0;
  TimedPoses now{};
  std::vector<TimedPoses> earlier = {};
};

// A change that was checked against the scene as all changes before it leave it.
struct AcceptedChange {
  std::uint64_t participant = 0;
  model::ParameterChange change{};
  v1::ParameterChange message{};
};

struct Inputs {
  std::vector<AcceptedChange> changes;
  std::vector<Poses> poses;
};

// Thread-safe. Bounded: one Poses with kMaxEarlierPoses a participant, kMaxChanges changes.
class Inbox {
 public:
  static constexpr std::size_t kMaxChanges = 64;
  // Of one participant in a tick; the oldest go.
  static constexpr std::ptrdiff_t kMaxAttachmentPoses = 256;
  // The same.
  static constexpr std::size_t kMaxEarlierPoses = 16;

  // Replaces what this participant posted since the last tick, but for where it put attachments that `poses`
  // says nothing of, and what was true at other times.
  void postPoses(std::uint64_t participant, model::ParticipantPoses poses, Clock::time_point arrival,
                 PoseTime time = {});
  // False if it is full.
  [[nodiscard]] bool postChange(AcceptedChange change);
  void dropChanges();
  void dropPoses();
  // Of the changes that wait, what they say of the scene's colliders; the rest is dropped.
  void keepColliderChanges();

  // Those that wait, oldest first. `visit` must not call this inbox.
  void forEachChange(const std::function<void(const model::ParameterChange&)>& visit);

  // Moves everything to `out`, whose former contents go; the two keep swapping their memory.
  void drain(Inputs& out);

 private:
  std::mutex mutex_;
  Inputs inputs_;
};

}  // namespace clothstream::stream
