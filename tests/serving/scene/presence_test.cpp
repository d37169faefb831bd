// SPDX-License-Identifier: MIT
// Presence of a participant: grace periods, and the time for which it was connected.
#include "server/scene/presence.h"

#include <chrono>

#include <gtest/gtest.h>

namespace clothstream::scene {
namespace {

using namespace std::chrono_literals;

constexpr Clock::time_point kJoined{1h};

TEST(Presence, PosesExpireBeforeThePlace) {
  ParticipantRecord record{.connectedSince = kJoined};
  EXPECT_FALSE(placeExpired(record, kJoined + 10h));
  setAway(record, {.place = 60s, .poses = 2s}, kJoined);
  EXPECT_FALSE(posesExpired(record, kJoined + 1999ms));
  EXPECT_TRUE(posesExpired(record, kJoined + 2s));
  EXPECT_FALSE(placeExpired(record, kJoined + 59999ms));
  EXPECT_TRUE(placeExpired(record, kJoined + 60s));
  EXPECT_TRUE(setConnected(record, kJoined + 60s));
  EXPECT_FALSE(setConnected(record, kJoined + 60s));
  EXPECT_FALSE(posesExpired(record, kJoined + 10h));
}

TEST(Presence, PosesDoNotOutliveThePlace) {
  ParticipantRecord record{.connectedSince = kJoined};
  setAway(record, {.place = 1s, .poses = 2s}, kJoined);
  EXPECT_TRUE(posesExpired(record, kJoined + 1s));
}

TEST(Presence, TimeAwayDoesNotCount) {
  ParticipantRecord record{.connectedSince = kJoined};
  EXPECT_EQ(timeConnected(record, kJoined + 5s), 5s);
  setAway(record, {}, kJoined + 10s);
  setAway(record, {}, kJoined + 20s);  // its grace begins again
  EXPECT_EQ(timeConnected(record, kJoined + 30s), 10s);
  setConnected(record, kJoined + 40s);
  EXPECT_EQ(timeConnected(record, kJoined + 43s), 13s);
}

}  // namespace
}  // namespace clothstream::scene
