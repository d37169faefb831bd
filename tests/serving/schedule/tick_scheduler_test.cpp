// SPDX-License-Identifier: MIT
// Scenes of known cost on a device without preemption, with a simulated clock.
#include "server/schedule/tick_scheduler.h"

#include <algorithm>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::schedule {
namespace {

using namespace std::chrono_literals;

constexpr Clock::duration kSlice = 10ms;

struct SimulatedScene : TickSchedule {
  SimulatedScene(std::uint32_t rate, Clock::duration tick, bool isGuest)
      : TickSchedule(rate, isGuest), work(tick) {
    running = true;
  }
  Clock::duration nextSlice() const { return guest ? std::min(work - used, slice) : work - used; }

  Clock::duration work, used{};
  Clock::duration slice = kSlice;  // of a guest
  Clock::time_point served{};
  int ticks = 0;
  double slipped = 0;
  Clock::duration worstLateness{};
};

class TickSchedulerTest : public ::testing::Test {
 protected:
  // A tick of a guest is done in slices, other ticks are not interrupted. `start`: its first tick is due.
  SimulatedScene& add(std::uint32_t rate, Clock::duration cost, bool guest = false,
                      Clock::duration start = {}) {
    scenes_.push_back(std::make_unique<SimulatedScene>(rate, cost, guest));
    scenes_.back()->pacer.start(now_ + start);
    return *scenes_.back();
  }
  std::vector<SimulatedScene*> addGuests(int count, std::uint32_t rate, Clock::duration cost) {
    std::vector<SimulatedScene*> guests;
    for (int i = 0; i < count; ++i) guests.push_back(&add(rate, cost, true));
    return guests;
  }

  // Runs the scenes for this time, as the device thread does.
  void run(Clock::duration time) {
    std::vector<TickSchedule*> turns, chosen;
    for (const auto& scene : scenes_) turns.push_back(scene.get());
    const Clock::time_point end = now_ + time;
    for (;;) {
      scheduler_.observe(turns, now_);
      Clock::time_point due = Clock::time_point::max();
      for (const TickSchedule* turn : turns)
        if (turn->running)
          due = std::min(due, std::max(turn->begun ? now_ : turn->pacer.due(), scheduler_.earliest(*turn)));
      now_ = std::max(now_, due);
      if (now_ >= end) return;
      scheduler_.choose(turns, now_, chosen);
      for (TickSchedule* turn : chosen) beginTick(sceneOf(turn));
      // The device works on all of them together.
      for (TickSchedule* turn : chosen) now_ += sceneOf(turn).nextSlice();
      for (TickSchedule* turn : chosen) endSlice(sceneOf(turn));
      scheduler_.observe(turns, now_);
      SimulatedScene* next = nullptr;
      for (const auto& scene : scenes_)
        if (scene->begun && scheduler_.earliest(*scene) <= now_ &&
            (next == nullptr || scene->served < next->served))
          next = scene.get();
      if (next == nullptr) continue;
      now_ += next->nextSlice();
      endSlice(*next);
    }
  }
  // Ticks so far do not count.
  void forgetTicks() {
    for (const auto& scene : scenes_) {
      scene->ticks = 0;
      scene->slipped = 0;
      scene->worstLateness = {};
    }
  }

 private:
  void beginTick(SimulatedScene& scene) const {
    const Pacer::Start start = scene.pacer.begin(now_, scene.catchUp);
    scene.slipped += start.slippedTicks;
    scene.worstLateness = std::max(scene.worstLateness, start.lateness);
    scene.used = {};
    ++scene.ticks;
  }
  void endSlice(SimulatedScene& scene) {
    const Clock::duration slice = scene.nextSlice();
    scene.used += slice;
    scene.served = now_;
    scheduler_.used(scene, slice);
    scene.begun = scene.used < scene.work;
    if (!scene.begun) scene.tickEnded(scene.used, now_);
  }
  static SimulatedScene& sceneOf(TickSchedule* turn) { return static_cast<SimulatedScene&>(*turn); }

  Clock::time_point now_{};
  TickScheduler scheduler_{kSlice};
  std::vector<std::unique_ptr<SimulatedScene>> scenes_;
};

TEST_F(TickSchedulerTest, HeavySceneUsesTheTimeThatOthersLeave) {
  std::vector<SimulatedScene*> light;
  for (int i = 0; i < 8; ++i) light.push_back(&add(72, 1ms));
  SimulatedScene& heavy = add(72, 50ms);
  run(10s);
  for (const SimulatedScene* scene : light) {
    EXPECT_GE(scene->ticks, 0.99 * 720);
    // The first tick of the heavy scene is not yet known to be long.
    EXPECT_LE(scene->slipped, 50.0 / 1000 * 72);
    EXPECT_LE(scene->worstLateness, 50ms + 14ms + 8ms);
  }
  const double left = 1 - 8 * 0.001 * 72;
  EXPECT_GE(heavy.ticks, 0.9 * left * 10 / 0.050);
  EXPECT_LE(heavy.ticks, 1.0 * left * 10 / 0.050 + 1);
}

TEST_F(TickSchedulerTest, SingleSceneIsNotDelayed) {
  SimulatedScene& heavy = add(72, 50ms);
  run(10s);
  EXPECT_EQ(heavy.ticks, 200);
}

TEST_F(TickSchedulerTest, HeavySceneGetsAnEqualShareOfASlowDevice) {
  std::vector<SimulatedScene*> light;
  for (int i = 0; i < 9; ++i) light.push_back(&add(72, 3ms));  // together nearly twice the time of the device
  SimulatedScene& heavy = add(72, 50ms);
  run(10s);
  EXPECT_NEAR(heavy.ticks, 10 / (10 * 0.050), 3);
  const auto [least, most] = std::ranges::minmax(light, {}, &SimulatedScene::ticks);
  EXPECT_GE(least->ticks, 0.95 * most->ticks);
  EXPECT_GE(least->ticks, 0.9 * (10 - heavy.ticks * 0.050) / (9 * 0.003));
}

TEST_F(TickSchedulerTest, HeavyScenesAlternate) {
  SimulatedScene& light = add(72, 1ms);
  SimulatedScene &first = add(72, 40ms), &second = add(30, 40ms);
  run(10s);
  EXPECT_GE(light.ticks, 0.99 * 720);
  EXPECT_NEAR(first.ticks, second.ticks, 2);
  EXPECT_GE(first.ticks + second.ticks, 0.9 * (1 - 0.072) * 10 / 0.040);
}

TEST_F(TickSchedulerTest, SleepingScenesDoNotCount) {
  SimulatedScene& resting = add(72, 1ms);
  resting.running = false;
  SimulatedScene& heavy = add(72, 50ms);
  run(1s);
  EXPECT_EQ(resting.ticks, 0);
  EXPECT_EQ(heavy.ticks, 20);
}

TEST_F(TickSchedulerTest, EarliestTickStartsFirstWithoutHeavyScenes) {
  SimulatedScene &slow = add(30, 2ms), &quick = add(90, 2ms);
  run(10s);
  EXPECT_EQ(slow.ticks, 300);
  EXPECT_EQ(quick.ticks, 900);
  EXPECT_LE(quick.worstLateness, 4ms);
}

TEST_F(TickSchedulerTest, GuestsTakeNoFramesFromOtherScenes) {
  SimulatedScene& own = add(72, 4ms);
  std::vector<SimulatedScene*> guests = addGuests(14, 72, 30ms);
  guests.push_back(&add(72, 3s, true));
  run(30s);
  EXPECT_EQ(own.slipped, 0);
  EXPECT_GE(own.ticks, 30 * 72 - 3);
  EXPECT_LE(own.worstLateness, 2 * kSlice);
  Clock::duration used{};
  for (const SimulatedScene* guest : guests) {
    EXPECT_GE(guest->ticks, 1);
    used += guest->ticks * guest->work;
  }
  // Half of the device is theirs.
  EXPECT_GE(used, 30s / 2 - 3s);
}

TEST_F(TickSchedulerTest, GuestsUseTheTimeThatOtherScenesLeave) {
  for (int i = 0; i < 3; ++i) add(72, 1ms);
  SimulatedScene& guest = add(1000, 2ms, true);
  run(10s);
  EXPECT_GE(guest.ticks * guest.work, 0.6 * 10s) << "its share is 0.25";
}

TEST_F(TickSchedulerTest, LongSlicesStayWithinTheShareOfGuests) {
  SimulatedScene &own = add(72, 3ms), &guest = add(10, 600ms, true);
  guest.slice = 12ms;  // own leaves gaps of 10.9 ms
  run(10s);
  EXPECT_GE(own.ticks, 0.99 * 720);
  EXPECT_NEAR(guest.ticks * seconds(guest.work), 0.5 * 10, 0.6);
}

TEST_F(TickSchedulerTest, CheapGuestsAllKeepTheirRate) {
  SimulatedScene& own = add(72, 500us);
  const std::vector<SimulatedScene*> guests = addGuests(64, 72, 200us);
  run(1s);  // until all costs are known
  forgetTicks();
  run(60s);
  EXPECT_GE(own.ticks, 60 * 72 - 1);
  EXPECT_EQ(own.slipped, 0);
  EXPECT_LE(own.worstLateness, 1ms);
  for (const SimulatedScene* guest : guests) {
    EXPECT_GE(guest->ticks, 60 * 72 - 1);
    EXPECT_EQ(guest->slipped, 0);
  }
}

TEST_F(TickSchedulerTest, GuestsOfDifferentRatesKeepThem) {
  SimulatedScene& own = add(72, 1ms);
  std::vector<SimulatedScene*> guests;
  const std::uint32_t rates[] = {30, 60, 72, 90};
  for (int i = 0; i < 64; ++i) guests.push_back(&add(rates[i % 4], 150us, true, i * 317us));
  run(1s);
  forgetTicks();
  run(60s);
  EXPECT_EQ(own.slipped, 0);
  EXPECT_LE(own.worstLateness, 1ms);
  for (std::size_t i = 0; i < guests.size(); ++i) {
    EXPECT_NEAR(guests[i]->ticks, 60 * rates[i % 4], 1);
    EXPECT_LE(guests[i]->worstLateness, 14ms);
  }
}

TEST_F(TickSchedulerTest, ExpensiveGuestRunsAmongCheapOnes) {
  SimulatedScene& own = add(72, 2ms);
  const std::vector<SimulatedScene*> cheap = addGuests(32, 72, 200us);
  SimulatedScene& expensive = add(10, 40ms, true);  // its slices fit no gap
  run(1s);
  forgetTicks();
  run(60s);
  EXPECT_EQ(own.slipped, 0);
  EXPECT_LE(own.worstLateness, kSlice);
  for (const SimulatedScene* guest : cheap) EXPECT_GE(guest->ticks, 0.97 * 60 * 72);
  EXPECT_GE(expensive.ticks * seconds(expensive.work), 0.03 * 60) << "its equal part is 0.015";
}

TEST_F(TickSchedulerTest, GuestsThatDoNotFitTakeTurns) {
  SimulatedScene& own = add(72, 2ms);
  const std::vector<SimulatedScene*> guests = addGuests(64, 72, 500us);  // more than twice what is left
  run(2s);
  forgetTicks();
  run(60s);
  EXPECT_EQ(own.slipped, 0);
  const auto [least, most] = std::ranges::minmax(guests, {}, &SimulatedScene::ticks);
  EXPECT_GE(least->ticks, 0.95 * most->ticks);
  EXPECT_GE(64 * least->ticks * seconds(least->work), 0.9 * (1 - 0.144) * 60);
}

TEST_F(TickSchedulerTest, GuestsGetTheirShareWithoutGaps) {
  SimulatedScene& own = add(72, 14ms);  // needs the whole device
  const std::vector<SimulatedScene*> guests = addGuests(64, 72, 500us);
  run(1s);
  forgetTicks();
  run(60s);
  EXPECT_GE(own.ticks * seconds(own.work), 0.5 * 60);
  const auto [least, most] = std::ranges::minmax(guests, {}, &SimulatedScene::ticks);
  EXPECT_GE(least->ticks, most->ticks - 2);
  EXPECT_GE(64 * least->ticks * seconds(least->work), 0.4 * 60);
}

TEST_F(TickSchedulerTest, GapsAreNotPaidForLater) {
  SimulatedScene& own = add(72, 500us);
  const std::vector<SimulatedScene*> guests = addGuests(64, 72, 200us);
  run(60s);
  own.work = 20ms;  // leaves no gaps
  run(1s);
  forgetTicks();
  run(10s);
  Clock::duration used{};
  for (const SimulatedScene* guest : guests) used += guest->ticks * guest->work;
  EXPECT_GE(used, 3s);
}

TEST_F(TickSchedulerTest, GuestsHaveTheWholeDeviceWithoutOtherScenes) {
  SimulatedScene &first = add(72, 40ms, true), &second = add(72, 40ms, true);
  run(10s);
  EXPECT_NEAR(first.ticks, second.ticks, 2);
  EXPECT_GE(first.ticks + second.ticks, 249);
}

}  // namespace
}  // namespace clothstream::schedule
