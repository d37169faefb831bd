// SPDX-License-Identifier: MIT
#include "server/scene/participant.h"

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {

void write(const Participant& participant, v1::Participant& message) {
  message.set_id(participant.id);
  message.set_display_name(participant.displayName);
  message.set_client_name(participant.clientName);
  message.set_role(toMessage(participant.role));
  message.set_away(participant.away);
  message.set_body(participant.body);
}

SavedParticipant toSaved(const ParticipantRecord& record) {
  SavedParticipant saved{.participant = record.participant,
                         .tokenHash = record.tokenHash,
                         .subject = record.subject,
                         .attempt = record.attempt,
                         .grantedRole = record.grantedRole,
                         .ownsByToken = record.rights.ownership == Ownership::always};
  saved.participant.away = true;
  return saved;
}

ParticipantRecord fromSaved(const SavedParticipant& saved) {
  ParticipantRecord record{.participant = saved.participant,
                           .tokenHash = saved.tokenHash,
                           .subject = saved.subject,
                           .rights = {.ownership = saved.ownsByToken ? Ownership::always : Ownership::never},
                           .grantedRole = saved.grantedRole,
                           .attempt = saved.attempt};
  record.participant.away = true;
  return record;
}

}  // namespace clothstream::scene
