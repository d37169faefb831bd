// SPDX-License-Identifier: MIT
// Poses of participants' colliders, grabs and local winds at the time of a tick, from poses with timestamps.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "server/model/input.h"
#include "server/scene/inbox.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

// Adds no delay. Between two poses it interpolates. After the newest pose, which is the usual case because
// poses take time to arrive, it extrapolates that pose's motion: slower and slower for a third of kGapTime,
// then back to the newest pose, where it stays. This bridges gaps between poses. A participant that sends no
// more poses because nothing moves ends up exactly at its last pose.
//
// Poses without a time act at once and are not extrapolated. Poses with a time are ordered by the client's
// own clock: late ones are dropped, and one of the same time replaces the older one. Attachments, joints,
// wantsContacts and wantsConstraints are not part of the history: they act at once.
//
// Belongs to the device's thread. Bounded: kMaxPoses for each participant.
class PoseHistory {
 public:
  static constexpr std::size_t kMaxPoses = 32;
  static constexpr std::chrono::milliseconds kGapTime{150};
  // Range of the time between two poses from which a motion is derived.
  static constexpr std::chrono::milliseconds kShortestStep{4}, kLongestStep{100};
  // A pose that is older than the newest one by at most this is late. If it is older still, the client's
  // clock was set back.
  static constexpr std::uint64_t kLatestUs = 1'000'000;

  // Adds the poses of a participant that arrived since the last tick.
  void add(Poses&& poses);

  // Calls `place` for each participant whose colliders, grabs or winds may differ from the previous call,
  // with the poses at this time. Its attachments and joints are those moved since the previous call.
  void place(Clock::time_point time,
             const std::function<void(std::uint64_t participant, const model::ParticipantPoses&)>& place);

  // The next place() is called for all participants that have colliders, grabs or winds.
  void repeat();

 private:
  struct Entry {
    Clock::time_point trueAt{};
    std::uint64_t clientTimeUs = 0;
    bool timed = false;
    std::vector<model::ParticipantCollider> colliders = {};
    std::vector<model::Grab> grabs = {};
    std::vector<model::HeldWind> winds = {};
  };
  struct Track {
    std::uint64_t participant = 0;
    std::vector<Entry> entries = {};  // never empty after add(); times ascend
    std::vector<model::AttachmentPose> attachments = {};
    std::vector<model::ColliderJoints> joints = {};
    bool wantsContacts = false, wantsConstraints = false;
    bool settled = false;  // nothing changes until more poses arrive
  };

  static void add(Track& track, TimedPoses&& poses);
  // Removes entries that no time from `time` on needs.
  static void prune(Track& track, Clock::time_point time);
  // Writes the poses at `time` to placed_.
  void placeAt(Track& track, Clock::time_point time);

  std::vector<Track> tracks_;
  model::ParticipantPoses placed_;
};

}  // namespace clothstream::scene
