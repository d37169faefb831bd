// SPDX-License-Identifier: MIT
// Admission to a scene: resume tokens, and places.
#include "server/scene/admission.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "server/scene/presence.h"
#include "server/scene/resume_token.h"

namespace clothstream::scene {
namespace {

using namespace std::chrono_literals;

constexpr Clock::time_point kNoon{12h};

std::string tokenWith(std::size_t number) {
  std::string token = std::to_string(number);
  token.resize(kTokenBytes, 'x');
  return token;
}

ParticipantRecord awayFor(std::uint64_t id, Clock::duration time, Role role, const char* address = "") {
  ParticipantRecord record{.participant = {.id = id, .displayName = {}, .clientName = {}, .role = role},
                           .tokenHash = hashOfToken(tokenWith(id)),
                           .address = address};
  setAway(record, {}, kNoon - time);
  return record;
}

TEST(RefusedTokens, ForgetTheOldest) {
  RefusedTokens tokens;
  for (std::size_t i = 0; i <= RefusedTokens::kMax; ++i) tokens.add(hashOfToken(tokenWith(i)));
  EXPECT_FALSE(tokens.contains(tokenWith(0)));
  EXPECT_TRUE(tokens.contains(tokenWith(1)));
  EXPECT_TRUE(tokens.contains(tokenWith(RefusedTokens::kMax)));
  EXPECT_FALSE(tokens.contains({}));
  RefusedTokens restored;
  restored.set(tokens.get());
  EXPECT_EQ(restored.get(), tokens.get());
}

TEST(Admission, ReturnNeedsTokenSubjectAndPlace) {
  ParticipantTable table{awayFor(1, 10s, Role::owner), awayFor(2, 59s, Role::owner)};
  table[1].subject = {.tenant = {}, .name = "ada"};
  const auto returning = [&](std::size_t token, const Subject& subject, Clock::time_point at) {
    const auto found = findReturning(table, tokenWith(token), subject, at);
    return found == table.end() ? 0 : found->id();
  };
  EXPECT_EQ(returning(1, {}, kNoon), 1u);
  EXPECT_EQ(returning(2, {}, kNoon), 0u);
  EXPECT_EQ(returning(2, table[1].subject, kNoon), 2u);
  EXPECT_EQ(returning(2, table[1].subject, kNoon + 1s), 0u);
  EXPECT_EQ(returning(3, {}, kNoon), 0u);
  setConnected(table[1], kNoon);
  EXPECT_EQ(returning(2, table[1].subject, kNoon + 1h), 2u) << "a connected one keeps its place";
}

TEST(Admission, EvictsTheLongestAway) {
  ParticipantTable table{awayFor(1, 5s, Role::viewer, "a"), awayFor(2, 9s, Role::owner, "b"),
                         awayFor(3, 9s, Role::participant, "a"), awayFor(4, 20s, Role::viewer, "b")};
  setConnected(table[3], kNoon);
  EXPECT_EQ(findLongestAway(table)->id(), 3u) << "the lowest role in a tie";
  EXPECT_EQ(findLongestAway(table, "b")->id(), 2u);
  EXPECT_EQ(findLongestAway(table, "c"), table.end());
  EXPECT_EQ(placesOf(table, "b"), 2u);
  for (ParticipantRecord& record : table) setConnected(record, kNoon);
  EXPECT_EQ(findLongestAway(table), table.end());
}

}  // namespace
}  // namespace clothstream::scene
