// SPDX-License-Identifier: MIT
#include "server/scene/roster.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"
#include "server/scene/resume_token.h"

namespace clothstream::scene {

using delivery::Mailbox;
using delivery::SharedBytes;

ParticipantTable::iterator Roster::find(const Mailbox& mailbox) {
  return std::ranges::find(participants_, subscribers_.participantOf(mailbox), &ParticipantRecord::id);
}

Role Roster::roleOf(const Mailbox& mailbox) const {
  const std::lock_guard lock(mutex_);
  const auto record =
      std::ranges::find(participants_, subscribers_.participantOf(mailbox), &ParticipantRecord::id);
  return record == participants_.end() ? Role::none : record->participant.role;
}

tl::expected<Roster::Admission, Roster::Refusal> Roster::join(const JoinRequest& request,
                                                              const std::shared_ptr<Mailbox>& mailbox,
                                                              std::atomic<std::uint64_t>& ids,
                                                              std::size_t limit, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (closed_) return tl::unexpected(Refusal::closed);
  if (bans_.contains(request.subject) || refusedTokens_.contains(request.token))
    return tl::unexpected(Refusal::removed);
  const auto known = findReturning(participants_, request.token, request.subject, now);
  if (known != participants_.end()) {
    if (request.attempt < known->attempt) return tl::unexpected(Refusal::late);
    return resume(*known, request, mailbox, now);
  }
  const bool hasMany =
      !request.address.empty() && placesOf(participants_, request.address) >= request.placesOfAddress;
  if (hasMany && !makeRoom(now, request.address)) return tl::unexpected(Refusal::addressHasMany);
  if (participants_.size() >= limit && !makeRoom(now)) return tl::unexpected(Refusal::full);
  return add(++ids, request, mailbox, now);
}

Roster::Admission Roster::resume(ParticipantRecord& record, const JoinRequest& request,
                                 const std::shared_ptr<Mailbox>& mailbox, Clock::time_point now) {
  record.attempt = request.attempt;
  record.address = request.address;  // not known after a restart, and it may have changed
  if (const std::shared_ptr<Mailbox> former = subscribers_.find(record.id())) {
    const SharedBytes last = delivery::error(
        v1::ERROR_CODE_TAKEN_OVER, "another connection used this participant's token and took over", true);
    subscribers_.remove(*former);
    former->close(last);
  }
  if (setConnected(record, now))
    subscribers_.announce(presenceMessage(v1::PRESENCE_KIND_RETURNED, record.participant));
  // Announced before the participant subscribes, because its Welcome already contains its role.
  limitRole(record, request.rights, now);
  subscribers_.add(mailbox, record.id());
  poses_.resume(record.id(), now);
  return admissionOf(record, request.token, true);
}

Roster::Admission Roster::add(std::uint64_t id, const JoinRequest& request,
                              const std::shared_ptr<Mailbox>& mailbox, Clock::time_point now) {
  const Role requested = demoted_.contains(request.subject) ? Role::viewer : request.role;
  const Role role = roleAtJoin(participants_, request.rights, requested);
  std::string token = makeToken();
  participants_.push_back({.participant = {.id = id,
                                           .displayName = request.displayName,
                                           .clientName = request.clientName,
                                           .role = role},
                           .tokenHash = hashOfToken(token),
                           .subject = request.subject,
                           .rights = request.rights,
                           .attempt = request.attempt,
                           .address = request.address,
                           .connectedSince = now});
  const ParticipantRecord& joined = participants_.back();
  poses_.add(id, role);
  if (journal_) journal_->joined(id, request.clientName, request.displayName);
  if (observer_) observer_->joined(joined.participant, request.subject);
  // Announced before the new participant subscribes, because its Welcome already contains itself.
  subscribers_.announce(presenceMessage(v1::PRESENCE_KIND_JOINED, joined.participant));
  subscribers_.add(mailbox, id);
  return admissionOf(joined, std::move(token), false);
}

Roster::Admission Roster::admissionOf(const ParticipantRecord& record, std::string token,
                                      bool resumed) const {
  Admission admission{.id = record.id(),
                      .role = record.participant.role,
                      .token = std::move(token),
                      .resumed = resumed,
                      .participants = {}};
  for (const ParticipantRecord& other : participants_) admission.participants.push_back(other.participant);
  return admission;
}

bool Roster::makeRoom(Clock::time_point now, const std::string& address) {
  const auto longestAway = findLongestAway(participants_, address);
  if (longestAway == participants_.end()) return false;
  erase(longestAway, LeaveReason::timedOut, 0, now);
  return true;
}

void Roster::renew(const Mailbox& mailbox, const Rights& rights, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (const auto record = find(mailbox); record != participants_.end()) limitRole(*record, rights, now);
}

void Roster::limitRole(ParticipantRecord& record, const Rights& rights, Clock::time_point now) {
  record.rights = rights;
  if (const Role role = roleWithin(record); role != record.participant.role) changeRole(record, role, 0, now);
  ensureOwner(now);
}

void Roster::changeRole(ParticipantRecord& record, Role role, std::uint64_t by, Clock::time_point now) {
  record.participant.role = role;
  poses_.setRole(record.id(), role, now);
  if (role == Role::viewer) {
    record.participant.body.clear();
    poses_.setBody(record.id(), {});
  }
  subscribers_.announce(presenceMessage(v1::PRESENCE_KIND_ROLE_CHANGED, record.participant, by));
}

void Roster::ensureOwner(Clock::time_point now) {
  if (isOwned(participants_)) return;
  if (const auto heir = findHeir(participants_); heir != participants_.end())
    changeRole(*heir, Role::owner, 0, now);
}

void Roster::leave(const Mailbox& mailbox, LeaveReason reason, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (const auto record = find(mailbox); record != participants_.end()) erase(record, reason, 0, now);
}

void Roster::disconnect(const Mailbox& mailbox, const ReconnectGrace& grace, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto record = find(mailbox);
  if (record == participants_.end()) return;
  if (grace.place <= Clock::duration::zero()) {
    erase(record, LeaveReason::timedOut, 0, now);
    return;
  }
  subscribers_.remove(mailbox);
  setAway(*record, grace, now);
  subscribers_.announce(presenceMessage(v1::PRESENCE_KIND_DISCONNECTED, record->participant));
}

void Roster::expire(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  for (auto record = participants_.begin(); record != participants_.end();) {
    if (posesExpired(*record, now)) poses_.withdraw(record->id(), now);
    if (placeExpired(*record, now))
      record = erase(record, LeaveReason::timedOut, 0, now);
    else
      ++record;
  }
}

ParticipantTable::iterator Roster::erase(ParticipantTable::iterator record, LeaveReason reason,
                                         std::uint64_t by, Clock::time_point now) {
  poses_.remove(record->id(), now);
  if (const std::shared_ptr<Mailbox> mailbox = subscribers_.find(record->id())) subscribers_.remove(*mailbox);
  const ParticipantRecord gone = std::move(*record);
  const auto next = participants_.erase(record);
  if (journal_) journal_->left(gone.id());
  reportLeft(gone, now);
  subscribers_.announce(leftMessage(gone.participant, reason, by));
  ensureOwner(now);
  return next;
}

void Roster::eraseAll(const SharedBytes& last) {
  subscribers_.closeAll(last);
  if (journal_)
    for (const ParticipantRecord& record : participants_) journal_->left(record.id());
  for (const ParticipantRecord& record : participants_) reportLeft(record, Clock::now());
  participants_.clear();
  poses_.clear();
}

void Roster::dismiss(const SharedBytes& last) {
  const std::lock_guard lock(mutex_);
  eraseAll(last);
}

void Roster::close(const SharedBytes& last) {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  eraseAll(last);
}

void Roster::reportLeft(const ParticipantRecord& record, Clock::time_point now) {
  if (observer_) observer_->left(record.participant, record.subject, timeConnected(record, now));
}

void Roster::observe(SceneObserver& observer) {
  const std::lock_guard lock(mutex_);
  observer_ = &observer;
}

void Roster::endObservation(bool everyoneLeaves) {
  const std::lock_guard lock(mutex_);
  if (everyoneLeaves)
    for (const ParticipantRecord& record : participants_) reportLeft(record, Clock::now());
  observer_ = nullptr;
}

bool Roster::knows(const std::string& token) const {
  const std::lock_guard lock(mutex_);
  return findByToken(participants_, token) != participants_.end();
}

SavedRoster Roster::saved() const {
  const std::lock_guard lock(mutex_);
  SavedRoster saved{.participants = {}, .bans = bans_.get(), .refusedTokenHashes = refusedTokens_.get()};
  for (const ParticipantRecord& record : participants_) saved.participants.push_back(toSaved(record));
  return saved;
}

void Roster::restore(const SavedRoster& from, const ReconnectGrace& grace, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  bans_.set(from.bans);
  refusedTokens_.set(from.refusedTokenHashes);
  for (const SavedParticipant& saved : from.participants) {
    ParticipantRecord& record = participants_.emplace_back(fromSaved(saved));
    setAway(record, grace, now);
    poses_.add(record.id(), record.participant.role, true);
    poses_.setBody(record.id(), record.participant.body);
    if (journal_)
      journal_->joined(record.id(), record.participant.clientName, record.participant.displayName);
  }
}

void Roster::restartGrace(const ReconnectGrace& grace, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  for (ParticipantRecord& record : participants_)
    if (record.participant.away) setAway(record, grace, now);
}

std::size_t Roster::size() const {
  const std::lock_guard lock(mutex_);
  return participants_.size();
}

std::size_t Roster::away() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::ranges::count_if(
      participants_, [](const ParticipantRecord& record) { return record.participant.away; }));
}

bool Roster::owned() const {
  const std::lock_guard lock(mutex_);
  return isOwned(participants_);
}

messages::Result<void> Roster::setRole(const Mailbox& by, const v1::SetRole& message, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto owner = find(by);
  if (owner == participants_.end()) return {};
  const auto target = maySetRole(participants_, *owner, message);
  if (!target) return tl::unexpected(target.error());
  ParticipantRecord& record = **target;
  const Role role = fromMessage(message.role());
  if (record.participant.role == role) return {};
  record.grantedRole = role > record.rights.highest();
  demoted_.remember(record.subject, role);
  changeRole(record, role, owner->id(), now);
  return {};
}

messages::Result<void> Roster::remove(const Mailbox& by, const v1::RemoveParticipant& message,
                                      Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto owner = find(by);
  if (owner == participants_.end()) return {};
  const auto target = mayRemove(participants_, *owner, message);
  if (!target) return tl::unexpected(target.error());
  const std::uint64_t remover = owner->id();
  if (!message.ban()) {
    expel(*target, "an owner removed this participant from the scene", remover, now);
    return {};
  }
  const Subject subject = (*target)->subject;
  if (!bans_.add({.subject = subject, .displayName = (*target)->participant.displayName}))
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_RESOURCE_EXHAUSTED,
        fmt::format("removeParticipant.ban: the scene has {} bans, its maximum; lift one first (liftBan)",
                    BanList::kMax)});
  for (auto other = participants_.begin(); other != participants_.end();)
    other = other->subject == subject ? expel(other, "an owner banned you from the scene", remover, now)
                                      : other + 1;
  return {};
}

ParticipantTable::iterator Roster::expel(ParticipantTable::iterator record, const char* why, std::uint64_t by,
                                         Clock::time_point now) {
  if (const std::shared_ptr<Mailbox> mailbox = subscribers_.find(record->id()))
    mailbox->close(delivery::error(v1::ERROR_CODE_REMOVED, why, true));
  refusedTokens_.add(record->tokenHash);
  return erase(record, LeaveReason::removed, by, now);
}

std::string Roster::bodyOf(const Mailbox& mailbox) const {
  const std::lock_guard lock(mutex_);
  const auto record =
      std::ranges::find(participants_, subscribers_.participantOf(mailbox), &ParticipantRecord::id);
  return record == participants_.end() ? std::string() : record->participant.body;
}

messages::Result<void> Roster::wear(const Mailbox& by, const std::string& body) {
  const std::lock_guard lock(mutex_);
  const auto record = find(by);
  if (record == participants_.end()) return {};
  Participant& wearer = record->participant;
  if (auto permitted = permit(wearer.role, Action::wear, {}); !permitted) return permitted;
  if (wearer.body == body) return {};
  if (!body.empty())
    for (const ParticipantRecord& other : participants_)
      if (other.participant.body == body)
        return tl::unexpected(messages::FieldError{
            v1::ERROR_CODE_PERMISSION_DENIED,
            fmt::format(
                "wearBody.collider = \"{}\": participant {} wears it; take another body, or wait until it "
                "is given back",
                body, other.id())});
  wearer.body = body;
  poses_.setBody(wearer.id, body);
  subscribers_.announce(presenceMessage(v1::PRESENCE_KIND_BODY_CHANGED, wearer));
  return {};
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

}  // namespace clothstream::scene
