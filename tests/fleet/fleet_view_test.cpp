// SPDX-License-Identifier: MIT
// What a server knows of its fleet, from entries and times alone.
#include "server/fleet/fleet_view.h"

#include <chrono>
#include <cstdint>
#include <initializer_list>

#include <gtest/gtest.h>

#include "server/fleet/orphans.h"

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;
using Clock = FleetView::Clock;

constexpr std::uint64_t kSelf = 1, kOther = 2;

v1::ServerEntry serverEntry(std::uint64_t origin) {
  v1::ServerEntry entry;
  entry.set_origin(origin);
  return entry;
}

v1::SceneEntry sceneEntry(std::uint64_t origin) {
  v1::SceneEntry entry;
  entry.set_origin(origin);
  return entry;
}

class FleetViewTest : public ::testing::Test {
 protected:
  // Every server in the list renews its lease twice a second for this time.
  void pass(Clock::duration time, std::initializer_list<std::uint64_t> servers) {
    for (const Clock::time_point end = now + time; now < end; now += 500ms)
      for (const std::uint64_t origin : servers) view.renew(serverEntry(origin), true, now);
  }
  void SetUp() override {
    view.finishReading({}, now);
    view.setReads(true);
  }

  FleetView view{kSelf};
  Clock::time_point now{1h};
};

TEST_F(FleetViewTest, AServerIsGoneAfterItsLease) {
  pass(6s, {kSelf, kOther});
  pass(FleetView::kLease - 1s, {kSelf});
  EXPECT_TRUE(view.isAlive(kOther, now));
  pass(2s, {kSelf});
  EXPECT_FALSE(view.isAlive(kOther, now));
  EXPECT_TRUE(view.others(now).empty());
}

TEST_F(FleetViewTest, NobodyIsGoneWhileNothingIsHeard) {
  pass(6s, {kSelf, kOther});
  pass(7s, {});
  EXPECT_TRUE(view.isAlive(kOther, now));
  EXPECT_TRUE(view.isSilent(now));
  // Renewals of the other server may have been missed, too.
  pass(2s, {kSelf});
  EXPECT_TRUE(view.isAlive(kOther, now));
  EXPECT_FALSE(view.isSettled(now));
  pass(4s, {kSelf});
  EXPECT_FALSE(view.isAlive(kOther, now));
}

TEST_F(FleetViewTest, NewerEntriesOfScenesStay) {
  view.learn("veil", sceneEntry(kSelf), 7);
  view.learn("veil", sceneEntry(kOther), 6);
  EXPECT_EQ(view.ownRevisionOf("veil"), 7U);
  view.removeScene("veil", 6);
  EXPECT_NE(view.find("veil"), nullptr);
  view.replace("veil", sceneEntry(kOther), 2);
  EXPECT_FALSE(view.ownRevisionOf("veil"));
  view.finishReading({}, now);
  EXPECT_EQ(view.find("veil"), nullptr);
}

TEST(OrphansTest, AnOrphanIsAdoptedOrFree) {
  Orphans orphans;
  const Clock::time_point start(1h);
  EXPECT_TRUE(orphans.mayContinue("veil", start));
  EXPECT_FALSE(orphans.isDue("veil", start + 1s));
  orphans.add("veil", start);
  orphans.add("veil", start + 10s);
  EXPECT_TRUE(orphans.isDue("veil", start + 1s));
  orphans.postpone("veil", start + 20s);
  EXPECT_FALSE(orphans.isDue("veil", start + 19s));
  EXPECT_TRUE(orphans.mayContinue("veil", start + 29s));
  EXPECT_FALSE(orphans.mayContinue("veil", start + 30s));
}

}  // namespace
}  // namespace clothstream::fleet
