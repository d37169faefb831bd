// SPDX-License-Identifier: MIT
// Admission to a scene: resume tokens, and places.
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <vector>

#include "server/scene/participant.h"
#include "server/scene/subject.h"
#include "server/schedule/clock.h"

namespace clothstream::scene {

// Resume tokens of removed participants. Only their hashes are kept. Not thread-safe.
class RefusedTokens {
 public:
  // The oldest are forgotten.
  static constexpr std::size_t kMax = 256;

  void add(std::string hash);
  bool contains(const std::string& token) const;

  // Hashes, newest last.
  std::vector<std::string> get() const { return {hashes_.begin(), hashes_.end()}; }
  // Replaces the list by one that was saved.
  void set(const std::vector<std::string>& hashes) { hashes_.assign(hashes.begin(), hashes.end()); }

 private:
  std::deque<std::string> hashes_;
};

// The following functions return the end of the table if there is no such participant.

// Participant with this resume token. The time does not depend on the token.
ParticipantTable::const_iterator findByToken(const ParticipantTable& table, const std::string& token);
// Participant that a peer with this token and subject comes back as. A participant whose grace period is over
// has lost its place.
ParticipantTable::iterator findReturning(ParticipantTable& table, const std::string& token,
                                         const Subject& subject, Clock::time_point now);
// Participant that has been away longest; in a tie, the one with the lowest role. With an address only its
// participants count.
ParticipantTable::iterator findLongestAway(ParticipantTable& table, const std::string& address = {});

// Number of places that participants from this address have.
std::size_t placesOf(const ParticipantTable& table, const std::string& address);

}  // namespace clothstream::scene
