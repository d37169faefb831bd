// SPDX-License-Identifier: MIT
// Inputs of participants on their way from the endpoints' threads to the scene's next tick.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "server/model/input.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

using schedule::Clock;

// Time at which poses were measured.
struct PoseTime {
  std::optional<Clock::time_point> trueAt = {};  // nothing if it is not known
  std::uint64_t clientTimeUs = 0;                // on the client's own clock
};

struct TimedPoses {
  model::ParticipantPoses poses{};
  Clock::time_point arrival{};
  PoseTime time = {};
};

// Poses of one participant since the last tick; empty poses once the participant has left. `earlier` has
// those before the newest, oldest first, without attachments and joints, if their times are known.
struct Poses {
  std::uint64_t participant = 0;
  TimedPoses now{};
  std::vector<TimedPoses> earlier = {};
};

// A change that is valid after all changes accepted before it.
struct AcceptedChange {
  std::uint64_t participant = 0;
  model::ParameterChange change{};
  v1::ParameterChange message{};  // sent to all subscribers when the change is applied
};

struct Inputs {
  std::vector<AcceptedChange> changes;
  std::vector<Poses> poses;
};

// Thread-safe. Holds at most kMaxChanges changes, and one Poses with kMaxEarlierPoses for each participant
// that has posted since the newest drain(). Those who have left are kept up to kMaxPosters.
class Inbox {
 public:
  static constexpr std::size_t kMaxChanges = 64;
  // Attachment poses of one participant in a tick; the oldest are dropped.
  static constexpr std::ptrdiff_t kMaxAttachmentPoses = 256;
  // Earlier poses of one participant in a tick; the oldest are dropped.
  static constexpr std::size_t kMaxEarlierPoses = 16;
  // Participants with waiting poses beyond which one that has left is forgotten: the one who joined last,
  // since no tick has placed its colliders. Much more than a scene has at a time.
  static constexpr std::size_t kMaxPosters = 1024;

  // Replaces the poses that this participant posted since the last tick. Attachment poses are merged: the
  // newer pose of an attachment counts. Former poses are kept as `earlier` if `time` is known.
  void postPoses(std::uint64_t participant, model::ParticipantPoses poses, Clock::time_point arrival,
                 PoseTime time = {});
  // Returns false if the inbox is full.
  [[nodiscard]] bool postChange(AcceptedChange change);
  void dropChanges();
  void dropPoses();

  // Returns changes that drain() moved out, oldest first: the next drain() moves them again, before newer
  // ones. They may exceed kMaxChanges; until there is room again no change can be posted.
  void putBack(std::span<AcceptedChange> changes);

  // Visits the waiting changes, oldest first. `visit` must not call this inbox.
  void forEachChange(const std::function<void(const model::ParameterChange&)>& visit);

  // Numbers of waiting changes, and of participants with waiting poses.
  struct Depth {
    std::size_t changes = 0, poses = 0;
  };
  Depth depth() const;

  // Moves everything to `out` and drops the former contents of `out`. The two swap their memory, so that
  // nothing is allocated.
  void drain(Inputs& out);

 private:
  // The caller holds the lock.
  void forgetOneThatHasLeft();

  mutable std::mutex mutex_;
  Inputs inputs_;
};

}  // namespace clothstream::scene
