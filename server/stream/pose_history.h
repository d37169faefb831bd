// SPDX-License-Identifier: MIT
// Where participants' colliders and grabs are at a tick's time, from poses that say when they were true.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "server/model/input.h"
#include "server/stream/clock.h"
#include "server/stream/inbox.h"

namespace clothstream::stream {

// Belongs to the device's thread. Bounded: kMostPoses a participant. No delay is added: at a time between two
// poses it gives what lies between them, and after the newest one, as is common since poses take a while to
// arrive, where that one's motion leads: for a third of kGapTime slower and slower, then back to the newest
// pose, where it stays. So whoever says no more because nothing moves any more is where it said that it is,
// and a gap between poses is bridged.
//
// Poses without a time act at once, and are not led on. Of poses with a time, the client's own clock says
// which are newer: those that come late are dropped, those of the same time replace what they repeat.
// Attachments and wantsContacts take no part: they act at once.
class PoseHistory {
 public:
  static constexpr std::size_t kMostPoses = 32;
  static constexpr std::chrono::milliseconds kGapTime{150};
  // Two poses tell a motion where they lie this far apart.
  static constexpr std::chrono::milliseconds kShortestStep{4}, kLongestStep{100};
  // What says that it is older than the newest one by no more than this is late; else that clock has stepped.
  static constexpr std::uint64_t kLatestUs = 1'000'000;

  // What arrived of a participant since the last tick.
  void add(Poses&& poses);

  // For each participant whose colliders or grabs may be others than the last time: what holds at this time.
  // Attachments: those that were put somewhere since.
  void place(Clock::time_point time,
             const std::function<void(std::uint64_t participant, const model::ParticipantPoses&)>& place);

 private:
  struct Entry {
    Clock::time_point trueAt{};
    std::uint64_t clientTimeUs = 0;
    bool timed = false;
    std::vector<model::ParticipantCollider> colliders = {};
    std::vector<model::Grab> grabs = {};
  };
  struct Track {
    std::uint64_t participant = 0;
    std::vector<Entry> entries = {};  // never empty; times ascend
    std::vector<model::AttachmentPose> attachments = {};
    bool wantsContacts = false;
    bool settled = false;  // nothing changes until more arrives
  };

  static void add(Track& track, TimedPoses&& poses);
  // Forgets what no later time needs.
  static void prune(Track& track, Clock::time_point time);
  // Into placed_.
  void placeAt(Track& track, Clock::time_point time);

  std::vector<Track> tracks_;
  model::ParticipantPoses placed_;
};

}  // namespace clothstream::stream
