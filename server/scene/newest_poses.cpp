// SPDX-License-Identifier: MIT
#include "server/scene/newest_poses.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {
namespace {

PoseTime poseTime(const v1::ColliderPoses& message, Clock::time_point arrival) {
  PoseTime time{.clientTimeUs = message.client_time_us()};
  if (message.server_time_us() == 0) return time;
  if (time.clientTimeUs == 0) time.clientTimeUs = message.server_time_us();
  // The difference of two unsigned times, read as signed, is correct for both orders.
  const std::chrono::microseconds ahead(
      static_cast<std::int64_t>(message.server_time_us() - schedule::microseconds(arrival)));
  if (ahead > NewestPoses::kMaxAhead) return time;
  time.trueAt = arrival + std::max<std::chrono::microseconds>(ahead, -NewestPoses::kMaxBehind);
  return time;
}

}  // namespace

NewestPoses::Entries::iterator NewestPoses::find(std::uint64_t participant) {
  return std::ranges::find(entries_, participant, &Entry::participant);
}

void NewestPoses::add(std::uint64_t participant, Role role, bool posed) {
  const std::lock_guard lock(mutex_);
  Entry& entry = entries_.emplace_back();
  entry.participant = participant;
  entry.role = role;
  entry.posed = posed;
  if (surfaces_ != nullptr) surfaces_->add(participant, role);
}

void NewestPoses::setRole(std::uint64_t participant, Role role, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto entry = find(participant);
  if (entry == entries_.end()) return;
  const Role before = std::exchange(entry->role, role);
  if (surfaces_ != nullptr) surfaces_->setRole(participant, role);
  if (role == Role::viewer) {
    removeFromScene(*entry, now);
    entry->poses = {};
  } else if (role < before && !entry->poses.winds.empty()) {
    entry->poses.winds.clear();
    if (entry->posed) postAgain(*entry, now);
  }
}

void NewestPoses::setBody(std::uint64_t participant, const std::string& body) {
  const std::lock_guard lock(mutex_);
  if (const auto entry = find(participant); entry != entries_.end()) entry->body = body;
}

void NewestPoses::withdraw(std::uint64_t participant, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (const auto entry = find(participant); entry != entries_.end()) removeFromScene(*entry, now);
  if (surfaces_ != nullptr) surfaces_->withdraw(participant);
}

void NewestPoses::resume(std::uint64_t participant, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (surfaces_ != nullptr) surfaces_->resume(participant);
  const auto entry = find(participant);
  if (entry == entries_.end() || entry->posed) return;
  if (!entry->poses.acts()) return;
  entry->posed = true;
  postAgain(*entry, now);
}

void NewestPoses::remove(std::uint64_t participant, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto entry = find(participant);
  if (entry == entries_.end()) return;
  removeFromScene(*entry, now);
  entries_.erase(entry);
  if (surfaces_ != nullptr) surfaces_->remove(participant);
}

void NewestPoses::clear() {
  const std::lock_guard lock(mutex_);
  entries_.clear();
  if (surfaces_ != nullptr) surfaces_->clear();
  inbox_.dropPoses();
  if (budget_ != nullptr) static_cast<void>(budget_->chargeWinds(0));
  charge();
}

messages::Result<void> NewestPoses::post(const delivery::Mailbox& mailbox, const v1::ColliderPoses& message,
                                         model::ParticipantPoses poses, const Permissions& permissions,
                                         Clock::time_point arrival) {
  const std::lock_guard lock(mutex_);
  const auto entry = find(subscribers_.participantOf(mailbox));
  if (entry == entries_.end()) return {};
  if (auto permitted = permit(entry->role, message, permissions); !permitted) return permitted;
  messages::Result<void> joints;
  if (!poses.joints.empty()) {
    joints = limitJoints(*entry, message, poses);
    if (std::exchange(entry->bodyRefused, !joints)) joints = {};  // it has the error already
  }
  if (budget_ != nullptr && !poses.joints.empty()) {
    messages::Result<void> charged = budget_->chargeJoints();
    if (!charged) poses.joints.clear();
    if (!std::exchange(entry->jointsRefused, !charged) && !charged) joints = std::move(charged);
  }
  entry->posed = true;
  entry->poses = {.colliders = poses.colliders,
                  .grabs = poses.grabs,
                  .winds = poses.winds,
                  .wantsContacts = poses.wantsContacts,
                  .wantsConstraints = poses.wantsConstraints};
  const std::size_t sent = poses.colliders.size();
  limit(*entry, poses.colliders);
  messages::Result<void> winds = limitWinds(*entry, poses.winds);
  inbox_.postPoses(entry->participant, std::move(poses), arrival, poseTime(message, arrival));
  if (!joints) return joints;  // the next message may have the other errors
  if (!std::exchange(entry->windsRefused, !winds) && !winds) return winds;
  const bool wasLimited = std::exchange(entry->collidersLimited, entry->acting < sent);
  if (wasLimited || !entry->collidersLimited) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_RESOURCE_EXHAUSTED,
      fmt::format(
          "colliderPoses: {} of {} colliders act, hands and head first: the participants of a scene share "
          "its room for colliders evenly (--max-load, --profile); send fewer or smaller ones",
          entry->acting, sent),
      telemetry::Refusal::colliders});
}

void NewestPoses::divideRoom(Clock::time_point now) {
  if (budget_ == nullptr) return;
  const std::lock_guard lock(mutex_);
  ClothBounds bounds;
  const ClothBounds* const cloth = budget_->boundsOfCloth(bounds) ? &bounds : nullptr;
  for (Entry& entry : entries_)
    if (entry.posed) entry.needs = loadOf(entry.poses.colliders, cloth);
  share_ = shareOfEach();
  for (Entry& entry : entries_) {
    if (!entry.posed) continue;
    model::ParticipantPoses poses = entry.poses;
    trim(poses.colliders, share_, cloth);
    poses.winds.resize(std::min(poses.winds.size(), entry.winds));
    entry.uses = loadOf(poses.colliders, cloth);
    if (poses.colliders.size() == std::exchange(entry.acting, poses.colliders.size())) continue;
    inbox_.postPoses(entry.participant, std::move(poses), now);
  }
  charge();
}

void NewestPoses::postAgain(Entry& entry, Clock::time_point now) {
  model::ParticipantPoses poses = entry.poses;
  limit(entry, poses.colliders);
  // The answer to the next message says whether there is room.
  entry.windsRefused = false;
  static_cast<void>(limitWinds(entry, poses.winds));
  inbox_.postPoses(entry.participant, std::move(poses), now);
}

void NewestPoses::removeFromScene(Entry& entry, Clock::time_point now) {
  if (!entry.posed) return;
  inbox_.postPoses(entry.participant, {}, now);
  entry.posed = false;
  entry.needs = entry.uses = {};
  entry.acting = 0;
  model::ParticipantPoses none;
  // Fewer are never refused.
  static_cast<void>(limitWinds(entry, none.winds));
  charge();
}

ColliderLoad NewestPoses::shareOfEach() const {
  std::vector<double> hands, others;
  for (const Entry& entry : entries_) {
    hands.push_back(entry.needs.hands);
    others.push_back(entry.needs.others);
  }
  ColliderLoad share;
  share.hands = fairShare(hands, budget_->roomForHands());
  double used = 0;
  for (const double need : hands) used += std::min(need, share.hands);
  share.others = fairShare(others, budget_->roomForOthers(used));
  return share;
}

void NewestPoses::limit(Entry& entry, std::vector<model::ParticipantCollider>& colliders) {
  if (budget_ != nullptr && !(colliders.empty() && entry.acting == 0)) {
    ClothBounds bounds;
    const ClothBounds* const cloth = budget_->boundsOfCloth(bounds) ? &bounds : nullptr;
    const ColliderLoad needs = loadOf(colliders, cloth);
    if (needs != std::exchange(entry.needs, needs)) share_ = shareOfEach();
    const ColliderLoad uses = trim(colliders, share_, cloth) ? loadOf(colliders, cloth) : needs;
    if (uses != std::exchange(entry.uses, uses)) charge();
  }
  entry.acting = colliders.size();
}

messages::Result<void> NewestPoses::limitJoints(const Entry& entry, const v1::ColliderPoses& message,
                                                model::ParticipantPoses& poses) const {
  messages::Result<void> limited;
  for (std::size_t i = poses.joints.size(); i-- > 0;) {
    const std::string& collider = message.joints(static_cast<int>(i)).collider();
    const auto wearer = std::ranges::find(entries_, collider, &Entry::body);
    if (wearer == entries_.end() || wearer->participant == entry.participant) continue;
    poses.joints.erase(poses.joints.begin() + static_cast<std::ptrdiff_t>(i));
    limited = tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_PERMISSION_DENIED,
        fmt::format(
            "colliderPoses.joints[{}].collider = \"{}\": participant {} wears it, so only that participant "
            "moves it; move another one, or wait until it is given back",
            i, collider, wearer->participant)});
  }
  return limited;
}

messages::Result<void> NewestPoses::limitWinds(Entry& entry, std::vector<model::HeldWind>& winds) {
  std::size_t others = 0;
  for (const Entry& one : entries_) others += one.winds;
  others -= entry.winds;
  const std::size_t sent = winds.size(), room = windRoom_ - std::min(windRoom_, others);
  messages::Result<void> limited;
  if (sent > room) {
    winds.resize(room);
    limited = tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("colliderPoses.winds: {} of {} winds act: a scene and its participants have at most {} "
                    "local winds together",
                    room, sent, model::kMaxLocalWinds),
        telemetry::Refusal::colliders});
  }
  if (budget_ == nullptr || winds.size() == entry.winds) {
    entry.winds = winds.size();
    return limited;
  }
  if (auto charged = budget_->chargeWinds(others + winds.size()); !charged) {
    winds.resize(std::min(winds.size(), entry.winds));
    return charged;
  }
  entry.winds = winds.size();
  return limited;
}

void NewestPoses::charge() {
  if (budget_ == nullptr) return;
  ColliderLoad all;
  for (const Entry& entry : entries_) all += entry.uses;
  budget_->chargeColliders(all);
}

}  // namespace clothstream::scene
