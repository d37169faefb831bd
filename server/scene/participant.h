// SPDX-License-Identifier: MIT
// Participants of a scene as plain data.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/delivery/wire_types.h"
#include "server/scene/roles.h"
#include "server/scene/subject.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

using schedule::Clock;

struct Participant {
  std::uint64_t id = 0;
  std::string displayName, clientName;
  Role role = Role::none;
  bool away = false;   // disconnected; it may come back
  std::string body{};  // name of the collider that it wears; empty for none
};
void write(const Participant& participant, v1::Participant& message);

// Whether a participant becomes an owner without another owner's help.
enum class Ownership : std::uint8_t {
  never,
  ifNone,  // while the scene has no owner
  always,
};

// Permissions of a participant's identity in a scene.
struct Rights {
  Ownership ownership = Ownership::ifNone;
  bool onlyViews = false;  // viewer is its only role

  // Highest role without an owner's help.
  Role highest() const {
    if (onlyViews) return Role::viewer;
    return ownership == Ownership::never ? Role::participant : Role::owner;
  }
};

// Everything that the roster knows about a participant.
struct ParticipantRecord {
  std::uint64_t id() const { return participant.id; }

  Participant participant{};
  std::string tokenHash{};    // hashOfToken() of its resume token
  Subject subject{};          // of its identity; empty without one
  Rights rights{};            // of its identity
  bool grantedRole = false;   // an owner gave it a higher role than its identity permits
  std::uint32_t attempt = 0;  // of its newest session
  std::string address{};      // of its newest session; empty: its places are not limited

  // Its presence; functions of presence.h change these and `participant.away`.
  Clock::time_point posesExpire{}, placeExpires{};  // while it is away
  Clock::time_point connectedSince{};               // while it is not away
  Clock::duration connected{};                      // before
};

// In the order in which they joined.
using ParticipantTable = std::vector<ParticipantRecord>;

// A participant as it is kept beyond the end of the server. Fields mean the same as in ParticipantRecord.
struct SavedParticipant {
  Participant participant;
  std::string tokenHash;
  Subject subject;
  std::uint32_t attempt = 0;
  bool grantedRole = false;
  bool ownsByToken = false;  // its token has the role owner
};

// Whether a participant is connected does not outlive the server: it is away in both results.
SavedParticipant toSaved(const ParticipantRecord& record);
// Its next identity decides whether it may own the scene. Until then only a token of the former run counts.
ParticipantRecord fromSaved(const SavedParticipant& saved);

}  // namespace clothstream::scene
