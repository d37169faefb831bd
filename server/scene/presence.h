// SPDX-License-Identifier: MIT
// Presence of participants: connected, or away for a grace period, and the messages that announce it.
#pragma once

#include <chrono>
#include <cstdint>

#include "server/delivery/envelope.h"
#include "server/scene/participant.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

// Grace periods after a participant's connection is lost. Its colliders and grabs stay for `poses`, its place
// in the scene for `place`, or for `page` after its page was closed, which may reload; the shorter one
// counts.
struct ReconnectGrace {
  Clock::duration place = std::chrono::seconds(60);
  Clock::duration page = std::chrono::seconds(20);
  Clock::duration poses = std::chrono::seconds(2);
};

// The participant is connected from `now` on. Returns false if it was connected already.
bool setConnected(ParticipantRecord& record, Clock::time_point now);
// The participant is away, and its grace begins now.
void setAway(ParticipantRecord& record, const ReconnectGrace& grace, Clock::time_point now);

// Whether the participant is away and its grace period for poses, or for its place, is over.
bool posesExpired(const ParticipantRecord& record, Clock::time_point now);
bool placeExpired(const ParticipantRecord& record, Clock::time_point now);

// Time for which the participant was connected in this run of the server.
Clock::duration timeConnected(const ParticipantRecord& record, Clock::time_point now);

enum class LeaveReason : std::uint8_t { left, timedOut, removed };

// Messages for all subscribers. `by` is the participant that caused it, or 0.
delivery::SharedBytes presenceMessage(v1::PresenceKind kind, const Participant& participant,
                                      std::uint64_t by = 0);
delivery::SharedBytes leftMessage(const Participant& participant, LeaveReason reason, std::uint64_t by);

}  // namespace clothstream::scene
