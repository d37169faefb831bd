// SPDX-License-Identifier: MIT
// Who takes part in a scene.
#include "server/stream/roster.h"

#include <algorithm>
#include <cassert>
#include <chrono>
#include <limits>
#include <random>
#include <utility>

#include <fmt/format.h>

#include "server/stream/envelope.h"

namespace clothstream::stream {
namespace {

// Not to be guessed: 128 bits from the system.
std::string makeToken() {
  std::random_device random;
  std::string token;
  while (token.size() < Roster::kTokenBytes) {
    const std::uint32_t word = random();
    for (int shift = 0; shift < 32; shift += 8) token += static_cast<char>(word >> shift);
  }
  return token;
}

// Takes as long wherever they differ.
bool sameToken(const std::string& one, const std::string& other) {
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
  // The difference of two unsigned clocks, read as signed, is right whichever is ahead.
  const std::chrono::microseconds ahead(
      static_cast<std::int64_t>(message.server_time_us() - microseconds(arrival)));
  if (ahead > Roster::kMostAhead) return time;
  time.trueAt = arrival + std::max<std::chrono::microseconds>(ahead, -Roster::kMostBehind);
  return time;
}

}  // namespace

Roster::Entries::iterator Roster::find(const Mailbox& mailbox) {
  return std::ranges::find_if(entries_, [&](const Entry& entry) { return entry.mailbox.get() == &mailbox; });
}

Roster::Entries::iterator Roster::find(const std::string& token) {
  auto found = entries_.end();
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
    if (sameToken(entry->token, token)) found = entry;
  return found;
}

v1::Role Roster::roleOf(const Mailbox& mailbox) const {
  const std::lock_guard lock(mutex_);
  for (const Entry& entry : entries_)
    if (entry.mailbox.get() == &mailbox) return entry.told.role();
  return v1::ROLE_UNSPECIFIED;
}

tl::expected<Roster::Admission, Roster::Refusal> Roster::join(const Newcomer& newcomer,
                                                              const std::shared_ptr<Mailbox>& mailbox,
                                                              std::atomic<std::uint64_t>& ids,
                                                              std::size_t limit, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (closed_) return tl::unexpected(Refusal::closed);
  // Whose time is over has no place any more, also where nobody has noticed yet.
  const auto known = find(newcomer.token);
  if (known != entries_.end() && (known->mailbox || now < known->expires)) {
    if (newcomer.attempt < known->attempt) return tl::unexpected(Refusal::late);
    known->attempt = newcomer.attempt;
    return resume(*known, mailbox, now);
  }
  if (entries_.size() >= limit && !makeRoom(now)) return tl::unexpected(Refusal::full);

  const bool isOwned =
      std::ranges::any_of(entries_, [](const Entry& entry) { return entry.told.role() == v1::ROLE_OWNER; });
  Entry entry;
  entry.token = makeToken();
  entry.attempt = newcomer.attempt;
  entry.mailbox = mailbox;
  entry.told.set_id(++ids);
  entry.told.set_client_name(newcomer.clientName);
  entry.told.set_display_name(newcomer.displayName);
  entry.told.set_role(newcomer.role == v1::ROLE_VIEWER ? v1::ROLE_VIEWER
                      : isOwned                        ? v1::ROLE_PARTICIPANT
                                                       : v1::ROLE_OWNER);
  if (journal_) journal_->joined(entry.told.id(), newcomer.clientName, newcomer.displayName);
  announce(v1::PRESENCE_KIND_JOINED, entry.told);
  listen(mailbox);
  entries_.push_back(std::move(entry));
  return admissionOf(entries_.back(), false);
}

Roster::Admission Roster::resume(Entry& entry, const std::shared_ptr<Mailbox>& mailbox,
                                 Clock::time_point now) {
  if (entry.mailbox) {
    audience_.leave(*entry.mailbox);
    entry.mailbox->close(error(v1::ERROR_CODE_TAKEN_OVER,
                               "another connection came with this participant's token and has it now", true));
  }
  const bool wasAway = !entry.mailbox;
  entry.mailbox = mailbox;
  entry.told.set_away(false);
  if (wasAway) announce(v1::PRESENCE_KIND_RETURNED, entry.told);
  listen(mailbox);
  if (!entry.posed && !(entry.poses.colliders.empty() && entry.poses.grabs.empty())) {
    inbox_.postPoses(entry.told.id(), entry.poses, now);
    entry.posed = true;
  }
  return admissionOf(entry, true);
}

void Roster::listen(const std::shared_ptr<Mailbox>& mailbox) {
  // The limit is this roster's: the audience may be fuller, of who was too slow and has not left yet.
  [[maybe_unused]] const auto joined = audience_.join(mailbox, std::numeric_limits<std::size_t>::max());
  assert(joined == Audience::Joining::joined);
}

Roster::Admission Roster::admissionOf(const Entry& entry, bool resumed) const {
  Admission admission{.id = entry.told.id(),
                      .role = entry.told.role(),
                      .token = entry.token,
                      .resumed = resumed,
                      .participants = {}};
  for (const Entry& other : entries_) admission.participants.push_back(other.told);
  return admission;
}

void Roster::leave(const Mailbox& mailbox, v1::LeaveReason reason, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  if (const auto entry = find(mailbox); entry != entries_.end()) erase(entry, reason, 0, now);
}

void Roster::lose(const Mailbox& mailbox, const Holding& holding, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto entry = find(mailbox);
  if (entry == entries_.end()) return;
  if (holding.hold <= Clock::duration::zero()) {
    erase(entry, v1::LEAVE_REASON_TIMED_OUT, 0, now);
    return;
  }
  audience_.leave(mailbox);
  entry->mailbox.reset();
  entry->told.set_away(true);
  entry->vanishes = now + std::min(holding.still, holding.hold);
  entry->expires = now + holding.hold;
  announce(v1::PRESENCE_KIND_DISCONNECTED, entry->told);
}

void Roster::expire(Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    if (!entry->mailbox && now >= entry->vanishes) vanish(*entry, now);
    if (!entry->mailbox && now >= entry->expires)
      entry = erase(entry, v1::LEAVE_REASON_TIMED_OUT, 0, now);
    else
      ++entry;
  }
}

void Roster::vanish(Entry& entry, Clock::time_point now) {
  if (entry.posed) inbox_.postPoses(entry.told.id(), {}, now);
  entry.posed = false;
}

bool Roster::makeRoom(Clock::time_point now) {
  const auto longestAway = std::ranges::min_element(entries_, {}, [](const Entry& entry) {
    return entry.mailbox ? Clock::time_point::max() : entry.expires;
  });
  if (longestAway == entries_.end() || longestAway->mailbox) return false;
  erase(longestAway, v1::LEAVE_REASON_TIMED_OUT, 0, now);
  return true;
}

Roster::Entries::iterator Roster::erase(Entries::iterator entry, v1::LeaveReason reason, std::uint64_t by,
                                        Clock::time_point now) {
  vanish(*entry, now);
  if (entry->mailbox) audience_.leave(*entry->mailbox);
  const v1::Participant told = entry->told;
  const auto next = entries_.erase(entry);
  if (journal_) journal_->left(told.id());
  announce(v1::PRESENCE_KIND_LEFT, told, by, reason);
  findOwner(now);
  return next;
}

void Roster::findOwner(Clock::time_point now) {
  const auto is = [](v1::Role role) {
    return [role](const Entry& entry) { return entry.told.role() == role; };
  };
  if (std::ranges::any_of(entries_, is(v1::ROLE_OWNER))) return;
  // Of those who are there, before those who may come back.
  auto heir = std::ranges::find_if(entries_, [](const Entry& entry) {
    return entry.mailbox && entry.told.role() == v1::ROLE_PARTICIPANT;
  });
  if (heir == entries_.end()) heir = std::ranges::find_if(entries_, is(v1::ROLE_PARTICIPANT));
  if (heir != entries_.end()) changeRole(*heir, v1::ROLE_OWNER, 0, now);
}

void Roster::changeRole(Entry& entry, v1::Role role, std::uint64_t by, Clock::time_point now) {
  entry.told.set_role(role);
  if (role == v1::ROLE_VIEWER) {
    vanish(entry, now);
    entry.poses = {};
  }
  announce(v1::PRESENCE_KIND_ROLE_CHANGED, entry.told, by);
}

void Roster::clear() {
  if (journal_)
    for (const Entry& entry : entries_) journal_->left(entry.told.id());
  entries_.clear();
  inbox_.dropPoses();
}

void Roster::dismiss(const SharedBytes& last) {
  const std::lock_guard lock(mutex_);
  audience_.dismiss(last);
  clear();
}

void Roster::close(const SharedBytes& last) {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  audience_.close(last);
  clear();
}

std::size_t Roster::size() const {
  const std::lock_guard lock(mutex_);
  return entries_.size();
}

std::size_t Roster::away() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(
      std::ranges::count_if(entries_, [](const Entry& entry) { return !entry.mailbox; }));
}

bool Roster::owned() const {
  const std::lock_guard lock(mutex_);
  return std::ranges::any_of(entries_,
                             [](const Entry& entry) { return entry.told.role() == v1::ROLE_OWNER; });
}

messages::Result<void> Roster::post(const Mailbox& mailbox, const v1::ColliderPoses& message,
                                    model::ParticipantPoses poses, const Permissions& permissions,
                                    Clock::time_point arrival) {
  const std::lock_guard lock(mutex_);
  const auto entry = find(mailbox);
  if (entry == entries_.end()) return {};
  if (auto permitted = permit(entry->told.role(), message, permissions); !permitted) return permitted;
  entry->posed = true;
  entry->poses = {.colliders = poses.colliders, .grabs = poses.grabs, .wantsContacts = poses.wantsContacts};
  inbox_.postPoses(entry->told.id(), std::move(poses), arrival, poseTime(message, arrival));
  return {};
}

messages::Result<Roster::Entry*> Roster::target(const char* field, std::uint64_t id) {
  const auto entry =
      std::ranges::find_if(entries_, [&](const Entry& known) { return known.told.id() == id; });
  if (entry != entries_.end()) return &*entry;
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_NOT_FOUND,
      fmt::format("{}.participantId = {}: there is no such participant in this scene", field, id)});
}

messages::Result<void> Roster::setRole(const Mailbox& by, const v1::SetRole& message, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto owner = find(by);
  if (owner == entries_.end()) return {};
  if (auto permitted = permit(owner->told.role(), Act::setRole, {}); !permitted) return permitted;
  if (message.role() < v1::ROLE_VIEWER || message.role() > v1::ROLE_OWNER)
    return tl::unexpected(messages::FieldError{
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("setRole.role = {}: must be ROLE_VIEWER, ROLE_PARTICIPANT or ROLE_OWNER",
                    static_cast<int>(message.role()))});
  auto entry = target("setRole", message.participant_id());
  if (!entry) return tl::unexpected(std::move(entry).error());
  if ((*entry)->told.role() == message.role()) return {};
  const auto owners =
      std::ranges::count_if(entries_, [](const Entry& other) { return other.told.role() == v1::ROLE_OWNER; });
  if ((*entry)->told.role() == v1::ROLE_OWNER && owners == 1)
    return tl::unexpected(
        messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                             "setRole: the scene's only owner stays one; make somebody else an owner first"});
  changeRole(**entry, message.role(), owner->told.id(), now);
  return {};
}

messages::Result<void> Roster::remove(const Mailbox& by, const v1::RemoveParticipant& message,
                                      Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  const auto owner = find(by);
  if (owner == entries_.end()) return {};
  if (auto permitted = permit(owner->told.role(), Act::removeParticipant, {}); !permitted) return permitted;
  auto entry = target("removeParticipant", message.participant_id());
  if (!entry) return tl::unexpected(std::move(entry).error());
  if (const std::shared_ptr<Mailbox> mailbox = (*entry)->mailbox)
    mailbox->close(error(v1::ERROR_CODE_REMOVED, "an owner removed this participant from the scene", true));
  erase(entries_.begin() + (*entry - entries_.data()), v1::LEAVE_REASON_REMOVED, owner->told.id(), now);
  return {};
}

void Roster::announce(v1::PresenceKind kind, const v1::Participant& participant, std::uint64_t by,
                      v1::LeaveReason reason) {
  v1::ServerMessage message;
  v1::Presence& presence = *message.mutable_presence();
  presence.set_kind(kind);
  *presence.mutable_participant() = participant;
  presence.set_reason(reason);
  presence.set_by_participant_id(by);
  audience_.announce(serialise(message));
}

}  // namespace clothstream::stream
