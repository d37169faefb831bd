// SPDX-License-Identifier: MIT
#include "server/scene/presence.h"

#include <algorithm>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {
namespace {

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

bool setConnected(ParticipantRecord& record, Clock::time_point now) {
  if (!record.participant.away) return false;
  record.participant.away = false;
  record.connectedSince = now;
  return true;
}

void setAway(ParticipantRecord& record, const ReconnectGrace& grace, Clock::time_point now) {
  record.connected = timeConnected(record, now);
  record.participant.away = true;
  record.posesExpire = now + std::min(grace.poses, grace.place);
  record.placeExpires = now + grace.place;
}

bool posesExpired(const ParticipantRecord& record, Clock::time_point now) {
  return record.participant.away && now >= record.posesExpire;
}

bool placeExpired(const ParticipantRecord& record, Clock::time_point now) {
  return record.participant.away && now >= record.placeExpires;
}

Clock::duration timeConnected(const ParticipantRecord& record, Clock::time_point now) {
  return record.participant.away ? record.connected : record.connected + (now - record.connectedSince);
}

delivery::SharedBytes presenceMessage(v1::PresenceKind kind, const Participant& participant,
                                      std::uint64_t by) {
  v1::ServerMessage message;
  v1::Presence& presence = *message.mutable_presence();
  presence.set_kind(kind);
  write(participant, *presence.mutable_participant());
  presence.set_by_participant_id(by);
  return delivery::serialise(message);
}

delivery::SharedBytes leftMessage(const Participant& participant, LeaveReason reason, std::uint64_t by) {
  v1::ServerMessage message;
  v1::Presence& presence = *message.mutable_presence();
  presence.set_kind(v1::PRESENCE_KIND_LEFT);
  write(participant, *presence.mutable_participant());
  presence.set_reason(toMessage(reason));
  presence.set_by_participant_id(by);
  return delivery::serialise(message);
}

}  // namespace clothstream::scene
