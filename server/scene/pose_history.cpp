// SPDX-License-Identifier: MIT
#include "server/scene/pose_history.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "server/model/jump.h"
#include "server/scene/hand_limits.h"

namespace clothstream::scene {
namespace {

// Pose between `from` (part 0) and `to` (part 1); a part above 1 extrapolates. A pose that jumps stays at
// `from` until part 1.
model::Pose interpolate(const model::Pose& from, const model::Pose& to, float part, double stepSeconds) {
  const float reach = kMaxHandSpeed * static_cast<float>(stepSeconds);
  if ((to.position - from.position).squaredNorm() > reach * reach) return part < 1 ? from : to;
  const float turn = from.orientation.dot(to.orientation);
  model::Pose pose{.position = from.position + part * (to.position - from.position),
                   .orientation = to.orientation};
  if (std::abs(turn) < model::kMaxTurn && part > 1) return pose;
  const Eigen::Vector4f other =
      turn < 0 ? Eigen::Vector4f(-to.orientation.coeffs()) : to.orientation.coeffs();
  const Eigen::Vector4f mean = (1 - part) * from.orientation.coeffs() + part * other;
  pose.orientation.coeffs() = mean.normalized();
  return pose;
}

// Moves the elements of `now` that are in both lists.
template <typename Posed>
void move(std::vector<Posed>& now, const std::vector<Posed>& from, const std::vector<Posed>& to, float part,
          double stepSeconds) {
  for (Posed& posed : now) {
    const auto before = std::ranges::find(from, posed.id, &Posed::id);
    const auto after = std::ranges::find(to, posed.id, &Posed::id);
    if (before != from.end() && after != to.end())
      posed.pose = interpolate(before->pose, after->pose, part, stepSeconds);
  }
}

}  // namespace

void PoseHistory::add(Poses&& poses) {
  auto track = std::ranges::find(tracks_, poses.participant, &Track::participant);
  if (track == tracks_.end()) {
    // Has room for its first entry, so that no track stays empty if memory runs out.
    Track added{.participant = poses.participant};
    added.entries.reserve(1);
    track = tracks_.insert(track, std::move(added));
  }
  track->attachments = std::move(poses.now.poses.attachments);
  track->joints = std::move(poses.now.poses.joints);
  track->wantsContacts = poses.now.poses.wantsContacts;
  track->wantsConstraints = poses.now.poses.wantsConstraints;
  track->settled = false;
  for (TimedPoses& earlier : poses.earlier) add(*track, std::move(earlier));
  add(*track, std::move(poses.now));
}

void PoseHistory::add(Track& track, TimedPoses&& poses) {
  std::vector<Entry>& entries = track.entries;
  Entry entry{.trueAt = poses.time.trueAt.value_or(poses.arrival),
              .clientTimeUs = poses.time.clientTimeUs,
              .timed = poses.time.trueAt.has_value(),
              .colliders = std::move(poses.poses.colliders),
              .grabs = std::move(poses.poses.grabs),
              .winds = std::move(poses.poses.winds)};
  if (!entries.empty() && entry.timed && entries.back().timed) {
    const std::uint64_t newest = entries.back().clientTimeUs;
    if (entry.clientTimeUs < newest && newest - entry.clientTimeUs <= kLatestUs) return;
    // The client's clock was corrected, or a pose was sent twice: the newer message counts.
    std::erase_if(entries, [&](const Entry& known) {
      return known.trueAt >= entry.trueAt || known.clientTimeUs == entry.clientTimeUs;
    });
  } else {
    entries.clear();
  }
  if (entries.size() == kMaxPoses) entries.erase(entries.begin());
  entries.push_back(std::move(entry));
}

void PoseHistory::repeat() {
  for (Track& track : tracks_) track.settled = false;
}

void PoseHistory::prune(Track& track, Clock::time_point time) {
  std::vector<Entry>& entries = track.entries;
  const auto needed =
      std::ranges::find_if(entries, [&](const Entry& entry) { return entry.trueAt > time - kGapTime; });
  if (const auto past = needed - entries.begin(); past > 1)
    entries.erase(entries.begin(), entries.begin() + past - 1);
}

void PoseHistory::placeAt(Track& track, Clock::time_point time) {
  const std::vector<Entry>& entries = track.entries;
  const auto after = std::ranges::upper_bound(entries, time, {}, &Entry::trueAt);
  // The newest pose at or before `time`, or else the first pose, says what exists.
  const Entry& now = after == entries.begin() ? entries.front() : *(after - 1);
  placed_.colliders = now.colliders;
  placed_.grabs = now.grabs;
  placed_.winds = now.winds;
  const auto moveAll = [&](const Entry& from, const Entry& to, double part, double stepSeconds) {
    move(placed_.colliders, from.colliders, to.colliders, static_cast<float>(part), stepSeconds);
    move(placed_.grabs, from.grabs, to.grabs, static_cast<float>(part), stepSeconds);
    move(placed_.winds, from.winds, to.winds, static_cast<float>(part), stepSeconds);
  };
  if (after != entries.end()) {
    if (after == entries.begin()) return;
    const double step = schedule::seconds(after->trueAt - now.trueAt);
    moveAll(now, *after, schedule::seconds(time - now.trueAt) / step, step);
    return;
  }
  const double gap = schedule::seconds(time - now.trueAt) / schedule::seconds(kGapTime);
  track.settled = !now.timed || gap >= 1;
  if (track.settled) return;
  const auto newer = std::ranges::find_if(
      entries, [&](const Entry& entry) { return entry.trueAt > now.trueAt - kShortestStep; });
  if (newer == entries.begin()) return;
  const Entry& before = *(newer - 1);
  const double step = schedule::seconds(now.trueAt - before.trueAt);
  if (step > schedule::seconds(kLongestStep)) return;
  moveAll(before, now, 1 + gap * (1 - gap) * (1 - gap) * schedule::seconds(kGapTime) / step, step);
}

void PoseHistory::place(
    Clock::time_point time,
    const std::function<void(std::uint64_t participant, const model::ParticipantPoses&)>& place) {
  for (Track& track : tracks_) {
    if (track.settled) continue;
    prune(track, time);
    placeAt(track, time);
    placed_.attachments = std::move(track.attachments);
    track.attachments.clear();
    placed_.joints = std::move(track.joints);
    track.joints.clear();
    placed_.wantsContacts = track.wantsContacts;
    placed_.wantsConstraints = track.wantsConstraints;
    place(track.participant, placed_);
  }
  std::erase_if(tracks_, [](const Track& track) {
    const Entry& newest = track.entries.back();
    return track.settled && newest.colliders.empty() && newest.grabs.empty() && newest.winds.empty();
  });
}

}  // namespace clothstream::scene
