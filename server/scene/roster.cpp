// SPDX-License-Identifier: MIT
#include "server/scene/roster.h"

#include <algorithm>
#include <chrono>
#include <iterator>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/scene/token_hash.h"

namespace clothstream::scene {
namespace {

using delivery::Mailbox;
using delivery::SharedBytes;

// 128 random bits from the system, so that the token cannot be guessed.
std::string makeToken() {
  std::random_device random;
  std::string token;
  while (token.size() < Roster::kTokenBytes) {
    const std::uint32_t word = random();
    for (int shift = 0; shift < 32; shift += 8) token += static_cast<char>(word >> shift);
  }
  return token;
}

// Constant-time comparison.
bool isSame(const std::string& one, const std::string& other) {
  if (one.size() != other.size()) return false;
  unsigned different = 0;
  for (std::size_t i = 0; i < one.size(); ++i)
    different |= static_cast<unsigned char>(one[i]) ^ static_cast<unsigned char>(other[i]);
  return different == 0;
}

PoseTime poseTime(const v1::ColliderPoses& message, Clock::time_point arrival) {
  PoseTime time{.clientTimeUs = message.client_time_us()};
  if (message.server_time_us() == 0) return time;
  if (time.clientTimeUs == 0) time.clientTimeUs = message.server_time_us();
  // The difference of two unsigned times, read as signed, is correct for both orders.
  const std::chrono::microseconds ahead(
      static_cast<std::int64_t>(message.server_time_us() - schedule::microseconds(arrival)));
  if (ahead > Roster::kMaxAhead) return time;
  time.trueAt = arrival + std::max<std::chrono::microseconds>(ahead, -Roster::kMaxBehind);
  return time;
}

v1::LeaveReason toMessage(LeaveReason reason) {
  switch (reason) {
    case LeaveReason::left:
      return v1::LEAVE_REASON_LEFT;
    case LeaveReason::timedOut:
      return v1::LEAVE_REASON_TIMED_OUT;
    case LeaveReason::removed:
      return v1::LEAVE_REASON_REMOVED;
  }
  return v1::LEAVE_REASON_UNSPECIFIED;
}

}  // namespace

void write(const Participant& participant, v1::Participant& message) {
  message.set_id(participant.id);
  message.set_display_name(participant.displayName);
  message.set_client_name(participant.clientName);
  message.set_role(toMessage(participant.role));
  message.set_away(participant.away);
}

Roster::Entries::iterator Roster::find(const Mailbox& mailbox) {
  return std::ranges::find(entries_, subscribers_.participantOf(mailbox),
                           [](const Entry& entry) { return entry.participant.id; });
}

Roster::Entries::iterator Roster::find(const std::string& token) {
  auto found = entries_.end();
  if (token.size() != kTokenBytes) return found;
  const std::string hash = hashOfToken(token);
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
    if (isSame(entry->tokenHash, hash)) found = entry;
  return found;
}

bool Roster::isRefused(const std::string& token) const {
  if (token.size() != kTokenBytes) return false;
  const std::string hash = hashOfToken(token);
  bool refused = false;
  for (const std::string& known : refusedTokens_) refused |= isSame(known, hash);
  return refused;
}

Role Roster::roleOf(const Mailbox& mailbox) const {
  const std::lock_guard lock(mutex_);
  const std::uint64_t id = subscribers_.participantOf(mailbox);
  for (const Entry& entry : entries_)
    if (entry.participant.id == id) return entry.participant.role;
  return Role::none;
}

tl::expected<Roster::Admission, Roster::Refusal> Roster::join(const JoinRequest& request,
                                                              const std::shared_ptr<Mailbox>& mailbox,
                                                              std::atomic<std::uint64_t>& ids,
                                                              std::size_t limit, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (closed_) return tl::unexpected(Refusal::closed);
  if (bans_.contains(request.subject) || isRefused(request.token)) return tl::unexpected(Refusal::removed);
  // A participant whose grace period is over has lost its place, even if expire() was not called since.
  const auto known = find(request.token);
  if (known != entries_.end() && known->subject == request.subject &&
      (!known->participant.away || now < known->placeExpires)) {
    if (request.attempt < known->attempt) return tl::unexpected(Refusal::late);
    known->attempt = request.attempt;
    try {
      return resume(*known, request, mailbox, now);
    } catch (...) {
      // For example, memory ran out. A participant without a mailbox must count as disconnected: no session
      // would ever remove it.
      constexpr ReconnectGrace kGrace{};
      subscribers_.remove(*mailbox);
      setAway(*known, now);
      known->posesExpire = std::max(known->posesExpire, now + kGrace.poses);
      known->placeExpires = std::max(known->placeExpires, now + kGrace.place);
      throw;
    }
  }
  const bool hasMany = !request.address.empty() && placesOf(request.address) >= request.placesOfAddress;
  if (hasMany && !makeRoom(now, request.address)) return tl::unexpected(Refusal::addressHasMany);
  if (entries_.size() >= limit && !makeRoom(now)) return tl::unexpected(Refusal::full);

  const bool isOwned =
      std::ranges::any_of(entries_, [](const Entry& entry) { return entry.participant.role == Role::owner; });
  const Ownership ownership = request.rights.ownership;
  const bool owns = ownership == Ownership::always || (ownership == Ownership::ifNone && !isOwned);
  const bool demoted = isDemoted(request.subject);
  Entry entry;
  std::string token = makeToken();
  entry.tokenHash = hashOfToken(token);
  entry.subject = request.subject;
  entry.rights = request.rights;
  entry.attempt = request.attempt;
  entry.address = request.address;
  entry.connectedSince = now;
  entry.participant = {.id = ++ids,
                       .displayName = request.displayName,
                       .clientName = request.clientName,
                       .role = demoted || request.rights.onlyViews || request.role == Role::viewer
                                   ? Role::viewer
                               : owns ? Role::owner
                                      : Role::participant};
  entries_.push_back(std::move(entry));
  try {
    const Participant& joined = entries_.back().participant;
    Admission admission = admissionOf(entries_.back(), std::move(token), false);
    if (journal_) journal_->joined(joined.id, request.clientName, request.displayName);
    if (observer_) observer_->joined(joined, request.subject);
    // Announced before the new participant subscribes, because its Welcome already contains itself.
    announce(Presence::joined, joined);
    subscribers_.add(mailbox, joined.id);
    return admission;
  } catch (...) {
    // For example, memory ran out. No session would ever remove this participant.
    erase(std::prev(entries_.end()), LeaveReason::left, 0, now);
    throw;
  }
}

Roster::Admission Roster::resume(Entry& entry, const JoinRequest& request,
                                 const std::shared_ptr<Mailbox>& mailbox, Clock::time_point now) {
  if (const std::shared_ptr<Mailbox> former = subscribers_.find(entry.participant.id)) {
    const SharedBytes last = delivery::error(
        v1::ERROR_CODE_TAKEN_OVER, "another connection used this participant's token and took over", true);
    subscribers_.remove(*former);
    former->close(last);
  }
  const bool wasAway = std::exchange(entry.participant.away, false);
  if (wasAway) entry.connectedSince = now;
  entry.address = request.address;  // not known after a restart, and it may have changed
  if (wasAway) announce(Presence::returned, entry.participant);
  // Announced before the participant subscribes, because its Welcome already contains its role.
  limitRole(entry, request.rights, now);
  subscribers_.add(mailbox, entry.participant.id);
  if (!entry.posed && !(entry.poses.colliders.empty() && entry.poses.grabs.empty())) {
    entry.posed = true;
    model::ParticipantPoses poses = entry.poses;
    limit(entry, poses.colliders);
    inbox_.postPoses(entry.participant.id, std::move(poses), now);
  }
  return admissionOf(entry, request.token, true);
}

void Roster::limitRole(Entry& entry, const Rights& rights, Clock::time_point now) {
  entry.rights = rights;
  if (!entry.grantedRole && entry.participant.role > rights.highest())
    changeRole(entry, rights.highest(), 0, now);
  ensureOwner(now);
}

void Roster::renew(const Mailbox& mailbox, const Rights& rights, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (const auto entry = find(mailbox); entry != entries_.end()) limitRole(*entry, rights, now);
}

bool Roster::isDemoted(const Subject& subject) const {
  return !subject.empty() && std::ranges::find(demoted_, subject) != demoted_.end();
}

void Roster::rememberRole(const Subject& subject, Role role) {
  if (subject.empty()) return;
  std::erase(demoted_, subject);
  if (role == Role::viewer) demoted_.push_back(subject);
  if (demoted_.size() > kMaxDemoted) demoted_.pop_front();
}

Roster::Admission Roster::admissionOf(const Entry& entry, std::string token, bool resumed) const {
  Admission admission{.id = entry.participant.id,
                      .role = entry.participant.role,
                      .token = std::move(token),
                      .resumed = resumed,
                      .participants = {}};
  for (const Entry& other : entries_) admission.participants.push_back(other.participant);
  return admission;
}

void Roster::leave(const Mailbox& mailbox, LeaveReason reason, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (const auto entry = find(mailbox); entry != entries_.end()) erase(entry, reason, 0, now);
}

void Roster::disconnect(const Mailbox& mailbox, const ReconnectGrace& grace, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto entry = find(mailbox);
  if (entry == entries_.end()) return;
  if (grace.place <= Clock::duration::zero()) {
    erase(entry, LeaveReason::timedOut, 0, now);
    return;
  }
  subscribers_.remove(mailbox);
  setAway(*entry, now);
  entry->posesExpire = now + std::min(grace.poses, grace.place);
  entry->placeExpires = now + grace.place;
  announce(Presence::disconnected, entry->participant);
}

void Roster::expire(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const bool away = entry->participant.away;
    if (away && now >= entry->posesExpire) removePoses(*entry, now);
    if (away && now >= entry->placeExpires)
      entry = erase(entry, LeaveReason::timedOut, 0, now);
    else
      ++entry;
  }
  divideAgain(now);
}

void Roster::setAway(Entry& entry, Clock::time_point now) {
  if (!entry.participant.away) entry.connected += now - entry.connectedSince;
  entry.participant.away = true;
}

void Roster::reportLeft(const Entry& entry, Clock::time_point now) {
  if (observer_ == nullptr) return;
  const Clock::duration newest =
      entry.participant.away ? Clock::duration::zero() : now - entry.connectedSince;
  observer_->left(entry.participant, entry.subject, entry.connected + newest);
}

void Roster::removePoses(Entry& entry, Clock::time_point now) {
  if (!entry.posed) return;
  inbox_.postPoses(entry.participant.id, {}, now);
  entry.posed = false;
  entry.needs = entry.uses = {};
  entry.acting = 0;
  charge();
}

ColliderLoad Roster::shareOfEach() const {
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

void Roster::limit(Entry& entry, std::vector<model::ParticipantCollider>& colliders) {
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

void Roster::divideAgain(Clock::time_point now) {
  if (budget_ == nullptr) return;
  ClothBounds bounds;
  const ClothBounds* const cloth = budget_->boundsOfCloth(bounds) ? &bounds : nullptr;
  for (Entry& entry : entries_)
    if (entry.posed) entry.needs = loadOf(entry.poses.colliders, cloth);
  share_ = shareOfEach();
  for (Entry& entry : entries_) {
    if (!entry.posed) continue;
    model::ParticipantPoses poses = entry.poses;
    trim(poses.colliders, share_, cloth);
    entry.uses = loadOf(poses.colliders, cloth);
    if (poses.colliders.size() == std::exchange(entry.acting, poses.colliders.size())) continue;
    inbox_.postPoses(entry.participant.id, std::move(poses), now);
  }
  charge();
}

void Roster::charge() {
  if (budget_ == nullptr) return;
  ColliderLoad all;
  for (const Entry& entry : entries_) all += entry.uses;
  budget_->chargeColliders(all);
}

std::size_t Roster::placesOf(const std::string& address) const {
  return static_cast<std::size_t>(std::ranges::count(entries_, address, &Entry::address));
}

bool Roster::makeRoom(Clock::time_point now, const std::string& address) {
  // After a restart of the server, all participants have been away equally long.
  const auto isAway = [&](const Entry& entry) {
    return entry.participant.away && (address.empty() || entry.address == address);
  };
  const auto longestAway = std::ranges::min_element(entries_, {}, [&](const Entry& entry) {
    return std::pair(isAway(entry) ? entry.placeExpires : Clock::time_point::max(), entry.participant.role);
  });
  if (longestAway == entries_.end() || !isAway(*longestAway)) return false;
  erase(longestAway, LeaveReason::timedOut, 0, now);
  return true;
}

Roster::Entries::iterator Roster::erase(Entries::iterator entry, LeaveReason reason, std::uint64_t by,
                                        Clock::time_point now) {
  removePoses(*entry, now);
  if (const std::shared_ptr<Mailbox> mailbox = subscribers_.find(entry->participant.id))
    subscribers_.remove(*mailbox);
  const Entry gone = std::move(*entry);
  const auto next = entries_.erase(entry);
  if (journal_) journal_->left(gone.participant.id);
  reportLeft(gone, now);
  announceLeft(gone.participant, reason, by);
  ensureOwner(now);
  return next;
}

void Roster::ensureOwner(Clock::time_point now) {
  if (std::ranges::any_of(entries_, [](const Entry& entry) { return entry.participant.role == Role::owner; }))
    return;
  const auto mayOwn = [](const Entry& entry) {
    return entry.participant.role == Role::participant && entry.rights.ownership != Ownership::never;
  };
  // Connected participants come before those who are away.
  auto heir = std::ranges::find_if(
      entries_, [&](const Entry& entry) { return !entry.participant.away && mayOwn(entry); });
  if (heir == entries_.end()) heir = std::ranges::find_if(entries_, mayOwn);
  if (heir != entries_.end()) changeRole(*heir, Role::owner, 0, now);
}

void Roster::changeRole(Entry& entry, Role role, std::uint64_t by, Clock::time_point now) {
  entry.participant.role = role;
  if (role == Role::viewer) {
    removePoses(entry, now);
    entry.poses = {};
  }
  announce(Presence::roleChanged, entry.participant, by);
}

void Roster::clear() {
  if (journal_)
    for (const Entry& entry : entries_) journal_->left(entry.participant.id);
  for (const Entry& entry : entries_) reportLeft(entry, Clock::now());
  entries_.clear();
  inbox_.dropPoses();
  charge();
}

void Roster::dismiss(const SharedBytes& last) {
  const std::lock_guard lock(mutex_);
  subscribers_.closeAll(last);
  clear();
}

void Roster::close(const SharedBytes& last) {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  subscribers_.closeAll(last);
  clear();
}

void Roster::observe(SceneObserver& observer) {
  const std::lock_guard lock(mutex_);
  observer_ = &observer;
}

void Roster::endObservation(bool everyoneLeaves) {
  const std::lock_guard lock(mutex_);
  if (everyoneLeaves)
    for (const Entry& entry : entries_) reportLeft(entry, Clock::now());
  observer_ = nullptr;
}

bool Roster::knows(const std::string& token) const {
  if (token.size() != kTokenBytes) return false;
  const std::string hash = hashOfToken(token);
  const std::lock_guard lock(mutex_);
  bool known = false;
  for (const Entry& entry : entries_) known |= isSame(entry.tokenHash, hash);
  return known;
}

SavedRoster Roster::saved() const {
  const std::lock_guard lock(mutex_);
  SavedRoster saved{.participants = {},
                    .bans = bans_.get(),
                    .refusedTokenHashes = {refusedTokens_.begin(), refusedTokens_.end()}};
  for (const Entry& entry : entries_) {
    saved.participants.push_back({.participant = entry.participant,
                                  .tokenHash = entry.tokenHash,
                                  .subject = entry.subject,
                                  .attempt = entry.attempt,
                                  .grantedRole = entry.grantedRole,
                                  .ownsByToken = entry.rights.ownership == Ownership::always});
    // Whether a participant is connected does not outlive the server.
    saved.participants.back().participant.away = true;
  }
  return saved;
}

void Roster::restore(const SavedRoster& from, const ReconnectGrace& grace, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  bans_.set(from.bans);
  refusedTokens_.assign(from.refusedTokenHashes.begin(), from.refusedTokenHashes.end());
  for (const SavedParticipant& saved : from.participants) {
    Entry& entry = entries_.emplace_back();
    entry.participant = saved.participant;
    entry.participant.away = true;
    entry.tokenHash = saved.tokenHash;
    entry.subject = saved.subject;
    entry.attempt = saved.attempt;
    // Its next identity decides whether it may own the scene. Until then only a token of the former run
    // counts.
    entry.rights.ownership = saved.ownsByToken ? Ownership::always : Ownership::never;
    entry.grantedRole = saved.grantedRole;
    // The scene may have colliders and grabs of it from a checkpoint.
    entry.posed = true;
    entry.posesExpire = now + std::min(grace.poses, grace.place);
    entry.placeExpires = now + grace.place;
    if (journal_)
      journal_->joined(saved.participant.id, saved.participant.clientName, saved.participant.displayName);
  }
}

void Roster::restartGrace(const ReconnectGrace& grace, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  for (Entry& entry : entries_) {
    if (!entry.participant.away) continue;
    entry.posesExpire = now + std::min(grace.poses, grace.place);
    entry.placeExpires = now + grace.place;
  }
}

std::size_t Roster::size() const {
  const std::lock_guard lock(mutex_);
  return entries_.size();
}

std::size_t Roster::away() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::ranges::count_if(entries_, [](const Entry& entry) { return entry.participant.away; }));
}

bool Roster::owned() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(entries_,
                             [](const Entry& entry) { return entry.participant.role == Role::owner; });
}

messages::Result<void> Roster::post(const Mailbox& mailbox, const v1::ColliderPoses& message,
                                    model::ParticipantPoses poses, const Permissions& permissions,
                                    Clock::time_point arrival) {
  const std::lock_guard lock(mutex_);
  const auto entry = find(mailbox);
  if (entry == entries_.end()) return {};
  if (auto permitted = permit(entry->participant.role, message, permissions); !permitted) return permitted;
  messages::Result<void> joints;
  if (budget_ != nullptr && !poses.joints.empty()) {
    joints = budget_->chargeJoints();
    if (!joints) poses.joints.clear();
    if (std::exchange(entry->jointsRefused, !joints)) joints = {};  // it has the error already
  }
  entry->posed = true;
  entry->poses = {.colliders = poses.colliders,
                  .grabs = poses.grabs,
                  .wantsContacts = poses.wantsContacts,
                  .wantsConstraints = poses.wantsConstraints};
  const std::size_t sent = poses.colliders.size();
  limit(*entry, poses.colliders);
  inbox_.postPoses(entry->participant.id, std::move(poses), arrival, poseTime(message, arrival));
  if (!joints) return joints;  // the next message may have the other error
  const bool begins = !std::exchange(entry->limited, entry->acting < sent) && entry->limited;
  if (!begins) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_RESOURCE_EXHAUSTED,
      fmt::format(
          "colliderPoses: {} of {} colliders act, hands and head first: the participants of a scene share "
          "its room for colliders evenly (--max-scene-load, --max-load); send fewer or smaller ones",
          entry->acting, sent),
      telemetry::Refusal::colliders});
}

messages::Result<Roster::Entries::iterator> Roster::target(const char* field, std::uint64_t id) {
  const auto entry =
      std::ranges::find_if(entries_, [&](const Entry& known) { return known.participant.id == id; });
  if (entry != entries_.end()) return entry;
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_NOT_FOUND,
      fmt::format("{}.participantId = {}: there is no such participant in this scene", field, id)});
}

messages::Result<void> Roster::setRole(const Mailbox& by, const v1::SetRole& message, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto owner = find(by);
  if (owner == entries_.end()) return {};
  if (auto permitted = permit(owner->participant.role, Action::setRole, {}); !permitted) return permitted;
  if (message.role() < v1::ROLE_VIEWER || message.role() > v1::ROLE_OWNER)
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("setRole.role = {}: must be ROLE_VIEWER, ROLE_PARTICIPANT or ROLE_OWNER",
                    static_cast<int>(message.role()))});
  const auto entry = target("setRole", message.participant_id());
  if (!entry) return tl::unexpected(entry.error());
  if (auto may = mayActOn("setRole", *owner, **entry); !may) return may;
  const Role role = fromMessage(message.role());
  if ((*entry)->participant.role == role) return {};
  const auto owners = std::ranges::count_if(
      entries_, [](const Entry& other) { return other.participant.role == Role::owner; });
  if ((*entry)->participant.role == Role::owner && owners == 1)
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_INVALID_ARGUMENT,
        "setRole: the only owner of a scene cannot give up the role; make another participant owner first"});
  (*entry)->grantedRole = role > (*entry)->rights.highest();
  rememberRole((*entry)->subject, role);
  changeRole(**entry, role, owner->participant.id, now);
  return {};
}

messages::Result<void> Roster::mayActOn(const char* field, const Entry& by, const Entry& entry) const {
  const auto ownsByToken = [](const Entry& known) { return known.rights.ownership == Ownership::always; };
  if (!ownsByToken(entry) || ownsByToken(by)) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_PERMISSION_DENIED,
      fmt::format("{}.participantId = {}: is an owner by its token; only another owner by token may do this",
                  field, entry.participant.id)});
}

messages::Result<void> Roster::remove(const Mailbox& by, const v1::RemoveParticipant& message,
                                      Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto owner = find(by);
  if (owner == entries_.end()) return {};
  if (auto permitted = permit(owner->participant.role, Action::removeParticipant, {}); !permitted)
    return permitted;
  const auto entry = target("removeParticipant", message.participant_id());
  if (!entry) return tl::unexpected(entry.error());
  if (auto may = mayActOn("removeParticipant", *owner, **entry); !may) return may;
  const std::uint64_t remover = owner->participant.id;
  if (!message.ban()) {
    expel(*entry, "an owner removed this participant from the scene", remover, now);
    return {};
  }
  const Subject subject = (*entry)->subject;
  if (subject.empty())
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format(
            "removeParticipant.ban: participant {} has no subject, because it joined without a token, "
            "so a ban would have no effect; remove it without a ban",
            message.participant_id())});
  for (const Entry& other : entries_)
    if (other.subject == subject)
      if (auto may = mayActOn("removeParticipant", *owner, other); !may) return may;
  if (subject == owner->subject)
    return tl::unexpected(messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                                               "removeParticipant.ban: you cannot ban your own subject"});
  if (!bans_.add({.subject = subject, .displayName = (*entry)->participant.displayName}))
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("removeParticipant.ban: the scene has {} bans, its maximum; lift one first (liftBan)",
                    BanList::kMax)});
  for (auto other = entries_.begin(); other != entries_.end();)
    other = other->subject == subject ? expel(other, "an owner banned you from the scene", remover, now)
                                      : other + 1;
  return {};
}

Roster::Entries::iterator Roster::expel(Entries::iterator entry, const char* why, std::uint64_t by,
                                        Clock::time_point now) {
  if (const std::shared_ptr<Mailbox> mailbox = subscribers_.find(entry->participant.id))
    mailbox->close(delivery::error(v1::ERROR_CODE_REMOVED, why, true));
  refusedTokens_.push_back(entry->tokenHash);
  if (refusedTokens_.size() > kMaxRefusedTokens) refusedTokens_.pop_front();
  return erase(entry, LeaveReason::removed, by, now);
}

std::vector<Ban> Roster::bans() const {
  const std::lock_guard lock(mutex_);
  return bans_.get();
}

void Roster::setBans(std::vector<Ban> bans) {
  const std::lock_guard lock(mutex_);
  bans_.set(std::move(bans));
}

bool Roster::isBanned(const Subject& subject) const {
  const std::lock_guard lock(mutex_);
  return bans_.contains(subject);
}

bool Roster::liftBan(const std::string& name) {
  const std::lock_guard lock(mutex_);
  return bans_.lift(name);
}

void Roster::announce(Presence presence, const Participant& participant, std::uint64_t by) {
  v1::ServerMessage message;
  message.mutable_presence()->set_kind([&] {
    switch (presence) {
      case Presence::joined:
        return v1::PRESENCE_KIND_JOINED;
      case Presence::roleChanged:
        return v1::PRESENCE_KIND_ROLE_CHANGED;
      case Presence::disconnected:
        return v1::PRESENCE_KIND_DISCONNECTED;
      case Presence::returned:
        return v1::PRESENCE_KIND_RETURNED;
    }
    return v1::PRESENCE_KIND_UNSPECIFIED;
  }());
  write(participant, *message.mutable_presence()->mutable_participant());
  message.mutable_presence()->set_by_participant_id(by);
  subscribers_.announce(delivery::serialise(message));
}

void Roster::announceLeft(const Participant& participant, LeaveReason reason, std::uint64_t by) {
  v1::ServerMessage message;
  v1::Presence& presence = *message.mutable_presence();
  presence.set_kind(v1::PRESENCE_KIND_LEFT);
  write(participant, *presence.mutable_participant());
  presence.set_reason(toMessage(reason));
  presence.set_by_participant_id(by);
  subscribers_.announce(delivery::serialise(message));
}

}  // namespace clothstream::scene
