// SPDX-License-Identifier: MIT
#include "server/scene/inbox.h"

#include <algorithm>
#include <iterator>
#include <utility>

namespace clothstream::scene {

namespace {

// Adds the joints of colliders that newer poses do not move. Joints that should jump still jump.
void keepJoints(std::vector<model::ColliderJoints>& before, std::vector<model::ColliderJoints>& now) {
  for (model::ColliderJoints& joints : before) {
    const auto newer = std::ranges::find(now, joints.collider, &model::ColliderJoints::collider);
    if (newer == now.end())
      now.push_back(std::move(joints));
    else
      newer->jumps = newer->jumps || joints.jumps;
  }
  before.clear();
}

}  // namespace

void Inbox::postPoses(std::uint64_t participant, model::ParticipantPoses poses, Clock::time_point arrival,
                      PoseTime time) {
  const std::lock_guard lock(mutex_);
  const auto last = std::ranges::find(inputs_.poses, participant, &Poses::participant);
  if (last == inputs_.poses.end()) {
    if (inputs_.poses.size() >= kMaxPosters) forgetOneThatHasLeft();
    inputs_.poses.push_back({.participant = participant, .now = {std::move(poses), arrival, time}});
    return;
  }
  // The order is that of arrival, so that the later pose of an attachment counts.
  std::vector<model::AttachmentPose>& before = last->now.poses.attachments;
  poses.attachments.insert(poses.attachments.begin(), before.begin(), before.end());
  if (poses.attachments.size() > kMaxAttachmentPoses)
    poses.attachments.erase(poses.attachments.begin(), poses.attachments.end() - kMaxAttachmentPoses);
  keepJoints(last->now.poses.joints, poses.joints);
  if (!time.trueAt) {
    last->earlier.clear();
  } else {
    if (last->earlier.size() == kMaxEarlierPoses) last->earlier.erase(last->earlier.begin());
    before.clear();
    last->earlier.push_back(std::move(last->now));
  }
  last->now = {std::move(poses), arrival, time};
}

void Inbox::forgetOneThatHasLeft() {
  const auto hasLeft = [](const Poses& poses) { return !poses.now.poses.acts(); };
  auto newest = inputs_.poses.end();
  for (auto poses = inputs_.poses.begin(); poses != inputs_.poses.end(); ++poses)
    if (hasLeft(*poses) && (newest == inputs_.poses.end() || poses->participant > newest->participant))
      newest = poses;
  if (newest != inputs_.poses.end()) inputs_.poses.erase(newest);
}

bool Inbox::postChange(AcceptedChange change) {
  const std::lock_guard lock(mutex_);
  if (inputs_.changes.size() >= kMaxChanges) return false;
  inputs_.changes.push_back(std::move(change));
  return true;
}

void Inbox::putBack(std::span<AcceptedChange> changes) {
  const std::lock_guard lock(mutex_);
  inputs_.changes.insert(inputs_.changes.begin(), std::make_move_iterator(changes.begin()),
                         std::make_move_iterator(changes.end()));
}

void Inbox::dropChanges() {
  const std::lock_guard lock(mutex_);
  inputs_.changes.clear();
}

void Inbox::dropPoses() {
  const std::lock_guard lock(mutex_);
  inputs_.poses.clear();
}

void Inbox::forEachChange(const std::function<void(const model::ParameterChange&)>& visit) {
  const std::lock_guard lock(mutex_);
  for (const AcceptedChange& accepted : inputs_.changes) visit(accepted.change);
}

Inbox::Depth Inbox::depth() const {
  const std::lock_guard lock(mutex_);
  return {inputs_.changes.size(), inputs_.poses.size()};
}

void Inbox::drain(Inputs& out) {
  out.changes.clear();
  out.poses.clear();
  const std::lock_guard lock(mutex_);
  std::swap(out, inputs_);
}

}  // namespace clothstream::scene
