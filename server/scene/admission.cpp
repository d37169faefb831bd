// SPDX-License-Identifier: MIT
#include "server/scene/admission.h"

#include <algorithm>
#include <utility>

#include "server/scene/presence.h"
#include "server/scene/resume_token.h"

namespace clothstream::scene {

void RefusedTokens::add(std::string hash) {
  hashes_.push_back(std::move(hash));
  if (hashes_.size() > kMax) hashes_.pop_front();
}

bool RefusedTokens::contains(const std::string& token) const {
  if (token.size() != kTokenBytes) return false;
  const std::string hash = hashOfToken(token);
  bool refused = false;
  for (const std::string& known : hashes_) refused |= isSameHash(known, hash);
  return refused;
}

ParticipantTable::const_iterator findByToken(const ParticipantTable& table, const std::string& token) {
  auto found = table.end();
  if (token.size() != kTokenBytes) return found;
  const std::string hash = hashOfToken(token);
  for (auto record = table.begin(); record != table.end(); ++record)
    if (isSameHash(record->tokenHash, hash)) found = record;
  return found;
}

ParticipantTable::iterator findReturning(ParticipantTable& table, const std::string& token,
                                         const Subject& subject, Clock::time_point now) {
  const auto known = findByToken(table, token);
  if (known == table.end() || known->subject != subject || placeExpired(*known, now)) return table.end();
  return table.begin() + (known - table.cbegin());
}

ParticipantTable::iterator findLongestAway(ParticipantTable& table, const std::string& address) {
  const auto isAway = [&](const ParticipantRecord& record) {
    return record.participant.away && (address.empty() || record.address == address);
  };
  // After a restart of the server, all participants have been away equally long.
  const auto longest = std::ranges::min_element(table, {}, [&](const ParticipantRecord& record) {
    return std::pair(isAway(record) ? record.placeExpires : Clock::time_point::max(),
                     record.participant.role);
  });
  return longest != table.end() && isAway(*longest) ? longest : table.end();
}

std::size_t placesOf(const ParticipantTable& table, const std::string& address) {
  return static_cast<std::size_t>(std::ranges::count(table, address, &ParticipantRecord::address));
}

}  // namespace clothstream::scene
