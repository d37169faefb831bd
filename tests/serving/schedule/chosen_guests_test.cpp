// SPDX-License-Identifier: MIT
// Which guests begin at a time, among scenes whose costs are known.
#include <memory>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/schedule/tick_scheduler.h"

namespace clothstream::schedule {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

constexpr Clock::duration kSlice = 10ms;
constexpr Clock::time_point kNow{10s};

// One scene of the server, and guests. All have 50 ticks per second.
class ChosenGuestsTest : public ::testing::Test {
 protected:
  ChosenGuestsTest() { own.running = true; }

  TickSchedule& addGuest(Clock::duration cost, Clock::time_point due) {
    TickSchedule& guest = *guests_.emplace_back(std::make_unique<TickSchedule>(50, true));
    guest.running = true;
    guest.cost = cost;
    guest.pacer.start(due);
    return guest;
  }
  // Lets guests use the device before kNow, so that this is the time beyond their share at kNow.
  void exceed(Clock::duration excess) {
    const Clock::duration before = 2 * (kSlice + excess);  // half of it is their share
    scheduler.observe(all(), kNow - before);
    TickSchedule spender(50, true);
    scheduler.used(spender, before);
    scheduler.observe(all(), kNow);
  }
  std::vector<TickSchedule*> choose(Clock::time_point now = kNow) {
    std::vector<TickSchedule*> chosen;
    scheduler.choose(all(), now, chosen);
    return chosen;
  }

  TickSchedule own{50};
  TickScheduler scheduler{kSlice};

 private:
  std::vector<TickSchedule*> all() {
    std::vector<TickSchedule*> schedules{&own};
    for (const auto& guest : guests_) schedules.push_back(guest.get());
    return schedules;
  }

  std::vector<std::unique_ptr<TickSchedule>> guests_;
};

TEST_F(ChosenGuestsTest, GuestsThatFitTheGapBegin) {
  own.pacer.start(kNow + 5ms);
  TickSchedule &third = addGuest(1us, kNow), &second = addGuest(2ms, kNow - 1ms),
               &first = addGuest(3ms, kNow - 2ms);
  exceed(1ms);
  EXPECT_THAT(choose(), ElementsAre(&first, &second)) << "they fill the gap exactly";
  first.running = false;
  EXPECT_THAT(choose(), ElementsAre(&second, &third));
}

TEST_F(ChosenGuestsTest, LargeOneIsPassedOver) {
  own.pacer.start(kNow + 5ms);
  TickSchedule& first = addGuest(3ms, kNow - 3ms);
  addGuest(3ms, kNow - 2ms);
  TickSchedule& last = addGuest(2ms, kNow - 1ms);
  exceed(1ms);
  EXPECT_THAT(choose(), ElementsAre(&first, &last));
}

TEST_F(ChosenGuestsTest, SavedShareNeedsNoGap) {
  own.pacer.start(kNow);
  TickSchedule &first = addGuest(1500us, kNow - 3ms), &second = addGuest(1500us, kNow - 2ms);
  addGuest(1500us, kNow - 1ms);
  exceed(-4ms);
  EXPECT_THAT(choose(), ElementsAre(&own, &first, &second));
}

TEST_F(ChosenGuestsTest, OneBeginsWithinTheShare) {
  own.pacer.start(kNow);
  TickSchedule& first = addGuest(1ms, kNow - 1ms);
  addGuest(1ms, kNow);
  exceed(0ms);
  EXPECT_THAT(choose(), ElementsAre(&own, &first));
}

TEST_F(ChosenGuestsTest, ExcessMakesThemWait) {
  own.begun = true;
  TickSchedule& guest = addGuest(8ms, kNow);
  exceed(5ms);
  EXPECT_THAT(choose(), IsEmpty());
  EXPECT_EQ(scheduler.earliest(guest), kNow + 10ms);
  EXPECT_EQ(scheduler.earliest(own), kNow);
  EXPECT_THAT(choose(kNow + 10ms - 2ns), IsEmpty());
  EXPECT_THAT(choose(kNow + 10ms), ElementsAre(&guest));
}

TEST_F(ChosenGuestsTest, UnknownCostIsASlice) {
  TickSchedule& first = addGuest(0ms, kNow - 1ms);
  addGuest(0ms, kNow);
  own.pacer.start(kNow + kSlice - 1ns);
  exceed(1ms);
  EXPECT_THAT(choose(), IsEmpty());
  own.pacer.start(kNow + 2 * kSlice - 1ns);
  EXPECT_THAT(choose(), ElementsAre(&first));
}

TEST_F(ChosenGuestsTest, EachGetsItsPartOfTheShare) {
  own.begun = true;
  TickSchedule &cheap = addGuest(1ms, kNow), &expensive = addGuest(30ms, kNow);
  exceed(100ms);
  // A quarter of the device is theirs.
  EXPECT_THAT(choose(kNow + 4ms - 1ns), IsEmpty());
  EXPECT_THAT(choose(kNow + 4ms), ElementsAre(&cheap));
  cheap.pacer.begin(kNow + 4ms);
  scheduler.used(cheap, 1ms);
  EXPECT_THAT(choose(kNow + 4 * kSlice - 1ns), ElementsAre(&cheap));
  EXPECT_THAT(choose(kNow + 4 * kSlice), ElementsAre(&expensive)) << "it has waited longer";
}

TEST_F(ChosenGuestsTest, SlicesTakeTurnsWithTicks) {
  own.pacer.start(kNow + kSlice + 500us);
  TickSchedule &large = addGuest(1ms, kNow - 1ms), &small = addGuest(500us, kNow - 1ms),
               &expensive = addGuest(30ms, kNow);
  expensive.begun = true;
  exceed(20ms);
  expensive.newestUse = kNow - 2ms;
  EXPECT_THAT(choose(), ElementsAre(&small)) << "its next slice comes first";
  expensive.newestUse = kNow;
  EXPECT_THAT(choose(), testing::UnorderedElementsAre(&large, &small));
}

TEST_F(ChosenGuestsTest, GuestsAreEqualsWithoutOtherScenes) {
  own.running = false;
  TickSchedule &first = addGuest(8ms, kNow - 2ms), &second = addGuest(8ms, kNow - 1ms);
  EXPECT_THAT(choose(), ElementsAre(&first, &second));
}

TEST(ShareOf, DividesThePeriodAmongRunningScenesAndOnceAmongAllGuests) {
  TickSchedule one(50), two(100), firstGuest(50, true), secondGuest(50, true);
  const TickSchedule* const all[] = {&one, &two, &firstGuest, &secondGuest};
  TickScheduler scheduler(kSlice);
  one.running = true;
  scheduler.observe(all, kNow);
  EXPECT_EQ(scheduler.shareOf(one), 20ms);
  two.running = true;
  scheduler.observe(all, kNow);
  EXPECT_EQ(scheduler.shareOf(one), 10ms);
  EXPECT_EQ(scheduler.shareOf(two), 5ms);
  firstGuest.running = secondGuest.running = true;
  scheduler.observe(all, kNow);
  EXPECT_EQ(scheduler.shareOf(two), 5ms);
  EXPECT_EQ(scheduler.shareOf(firstGuest), Clock::duration(20ms) / 6);
  one.running = two.running = false;
  scheduler.observe(all, kNow);
  EXPECT_EQ(scheduler.shareOf(firstGuest), 10ms);
}

}  // namespace
}  // namespace clothstream::schedule
