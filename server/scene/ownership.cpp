// SPDX-License-Identifier: MIT
#include "server/scene/ownership.h"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {
namespace {

bool isOwner(const ParticipantRecord& record) {
  return record.participant.role == Role::owner;
}

tl::unexpected<messages::FieldError> invalid(std::string text) {
  return tl::unexpected(messages::FieldError{v1::ERROR_CODE_INVALID_ARGUMENT, std::move(text)});
}

// Participant that a request names in `field`.
messages::Result<ParticipantTable::iterator> findTarget(ParticipantTable& table, const char* field,
                                                        std::uint64_t id) {
  const auto target = std::ranges::find(table, id, &ParticipantRecord::id);
  if (target != table.end()) return target;
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_NOT_FOUND,
      fmt::format("{}.participantId = {}: there is no such participant in this scene", field, id)});
}

// Returns PERMISSION_DENIED if the participant is an owner by token and the sender is not.
messages::Result<void> mayActOn(const char* field, const ParticipantRecord& by,
                                const ParticipantRecord& target) {
  const auto ownsByToken = [](const ParticipantRecord& record) {
    return record.rights.ownership == Ownership::always;
  };
  if (!ownsByToken(target) || ownsByToken(by)) return {};
  return tl::unexpected(messages::FieldError{
      v1::ERROR_CODE_PERMISSION_DENIED,
      fmt::format("{}.participantId = {}: is an owner by its token; only another owner by token may do this",
                  field, target.id())});
}

}  // namespace

void DemotedSubjects::remember(const Subject& subject, Role role) {
  if (subject.empty()) return;
  std::erase(subjects_, subject);
  if (role == Role::viewer) subjects_.push_back(subject);
  if (subjects_.size() > kMax) subjects_.pop_front();
}

bool DemotedSubjects::contains(const Subject& subject) const {
  return std::ranges::find(subjects_, subject) != subjects_.end();
}

bool isOwned(const ParticipantTable& table) {
  return std::ranges::any_of(table, isOwner);
}

Role roleAtJoin(const ParticipantTable& others, const Rights& rights, Role requested) {
  if (rights.onlyViews || requested == Role::viewer) return Role::viewer;
  const bool owns =
      rights.ownership == Ownership::always || (rights.ownership == Ownership::ifNone && !isOwned(others));
  return owns ? Role::owner : Role::participant;
}

Role roleWithin(const ParticipantRecord& record) {
  const Role role = record.participant.role;
  return record.grantedRole ? role : std::min(role, record.rights.highest());
}

ParticipantTable::iterator findHeir(ParticipantTable& table) {
  const auto mayOwn = [](const ParticipantRecord& record) {
    return record.participant.role == Role::participant && record.rights.ownership != Ownership::never;
  };
  const auto isPresent = [&](const ParticipantRecord& record) {
    return !record.participant.away && mayOwn(record);
  };
  const auto present = std::ranges::find_if(table, isPresent);
  return present != table.end() ? present : std::ranges::find_if(table, mayOwn);
}

messages::Result<ParticipantTable::iterator> maySetRole(ParticipantTable& table, const ParticipantRecord& by,
                                                        const v1::SetRole& message) {
  if (auto permitted = permit(by.participant.role, Action::setRole, {}); !permitted)
    return tl::unexpected(permitted.error());
  if (message.role() < v1::ROLE_VIEWER || message.role() > v1::ROLE_OWNER)
    return invalid(fmt::format("setRole.role = {}: must be ROLE_VIEWER, ROLE_PARTICIPANT or ROLE_OWNER",
                               static_cast<int>(message.role())));
  auto target = findTarget(table, "setRole", message.participant_id());
  if (!target) return target;
  if (auto may = mayActOn("setRole", by, **target); !may) return tl::unexpected(may.error());
  if (isOwner(**target) && message.role() != v1::ROLE_OWNER && std::ranges::count_if(table, isOwner) == 1)
    return invalid(
        "setRole: the only owner of a scene cannot give up the role; make another participant owner first");
  return target;
}

messages::Result<ParticipantTable::iterator> mayRemove(ParticipantTable& table, const ParticipantRecord& by,
                                                       const v1::RemoveParticipant& message) {
  if (auto permitted = permit(by.participant.role, Action::removeParticipant, {}); !permitted)
    return tl::unexpected(permitted.error());
  auto target = findTarget(table, "removeParticipant", message.participant_id());
  if (!target) return target;
  if (auto may = mayActOn("removeParticipant", by, **target); !may) return tl::unexpected(may.error());
  if (!message.ban()) return target;
  const Subject& subject = (*target)->subject;
  if (subject.empty())
    return invalid(fmt::format(
        "removeParticipant.ban: participant {} has no subject, because it joined without a token, "
        "so a ban would have no effect; remove it without a ban",
        message.participant_id()));
  for (const ParticipantRecord& other : table)
    if (other.subject == subject)
      if (auto may = mayActOn("removeParticipant", by, other); !may) return tl::unexpected(may.error());
  if (subject == by.subject) return invalid("removeParticipant.ban: you cannot ban your own subject");
  return target;
}

}  // namespace clothstream::scene
