// SPDX-License-Identifier: MIT
// Roles in a scene: who owns it, and what owners may do to other participants.
#pragma once

#include <cstddef>
#include <deque>

#include "server/delivery/wire_types.h"
#include "server/messages/field_error.h"
#include "server/scene/participant.h"
#include "server/scene/roles.h"
#include "server/scene/subject.h"

namespace clothstream::scene {

// Subjects that an owner made viewers. Not thread-safe.
class DemotedSubjects {
 public:
  // The oldest are forgotten.
  static constexpr std::size_t kMax = 256;

  // An owner gave a participant of this subject this role.
  void remember(const Subject& subject, Role role);
  bool contains(const Subject& subject) const;

 private:
  std::deque<Subject> subjects_;  // newest last
};

bool isOwned(const ParticipantTable& table);

// Role of a participant with these rights that joins the others.
Role roleAtJoin(const ParticipantTable& others, const Rights& rights, Role requested);

// Role that the participant keeps with its present rights: one that no owner gave is at most what they
// permit.
Role roleWithin(const ParticipantRecord& record);

// Participant that becomes the owner of a scene that has none: the one that has been there longest of those
// that may own it, connected ones first. Viewers own nothing. End of the table if there is none.
ParticipantTable::iterator findHeir(ParticipantTable& table);

// Check requests of an owner, and return the participant that they name. Errors are NOT_FOUND if there is no
// such participant, PERMISSION_DENIED if `by` is no owner, or if the other is an owner by token
// (Ownership::always) and `by` is not, and INVALID_ARGUMENT.
[[nodiscard]] messages::Result<ParticipantTable::iterator> maySetRole(ParticipantTable& table,
                                                                      const ParticipantRecord& by,
                                                                      const v1::SetRole& message);
// A ban concerns all participants of the same subject.
[[nodiscard]] messages::Result<ParticipantTable::iterator> mayRemove(ParticipantTable& table,
                                                                     const ParticipantRecord& by,
                                                                     const v1::RemoveParticipant& message);

}  // namespace clothstream::scene
