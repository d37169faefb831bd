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

struct SimulatedScene {
  SimulatedScene(std::uint32_t rate, Clock::duration tick, bool guest) : turn(rate, guest), cost(tick) {
    turn.running = true;
    turn.pacer.start({});
  }
  TickSchedule turn;
  Clock::duration cost, used{};
  Clock::duration slice = kSlice;  // of a guest
  Clock::time_point served{};
  int ticks = 0;
  double slipped = 0;
  Clock::duration worstLateness{};
};

class TickSchedulerTest : public ::testing::Test {
 protected:
  // A tick of a guest is done in slices, other ticks are not interrupted.
  SimulatedScene& add(std::uint32_t rate, Clock::duration cost, bool guest = false) {
    return *scenes_.emplace_back(std::make_unique<SimulatedScene>(rate, cost, guest));
  }

  // Runs the scenes as the device thread does.
  void run(Clock::duration time) {
    TickScheduler scheduler(kSlice);
    std::vector<TickSchedule*> turns, chosen;
    for (const auto& scene : scenes_) turns.push_back(&scene->turn);
    Clock::time_point now{};
    const auto runSlice = [&](SimulatedScene& scene) {
      const Clock::duration left = scene.cost - scene.used;
      const Clock::duration slice = scene.turn.guest ? std::min(left, scene.slice) : left;
      now += slice;
      scene.used += slice;
      scene.served = now;
      scheduler.used(scene.turn, slice);
      scene.turn.begun = scene.used < scene.cost;
      if (!scene.turn.begun) scene.turn.tickEnded(scene.used, now);
    };
    for (;;) {
      Clock::time_point due = Clock::time_point::max();
      for (const TickSchedule* turn : turns) {
        if (!turn->running) continue;
        const Clock::time_point own = turn->begun ? now : turn->pacer.due();
        due = std::min(due, turn->guest ? std::max(own, scheduler.guestsFrom(turns, now)) : own);
      }
      now = std::max(now, due);
      if (now >= Clock::time_point{} + time) return;
      scheduler.choose(turns, now, chosen);
      for (TickSchedule* turn : chosen) {
        SimulatedScene& scene = sceneOf(turn);
        const Pacer::Start start = turn->pacer.begin(now, turn->catchUp);
        scene.slipped += start.slippedTicks;
        scene.worstLateness = std::max(scene.worstLateness, start.lateness);
        scene.used = {};
        ++scene.ticks;
      }
      for (TickSchedule* turn : chosen) runSlice(sceneOf(turn));
      const bool guestsRun = scheduler.guestsFrom(turns, now) <= now;
      SimulatedScene* next = nullptr;
      for (const auto& scene : scenes_)
        if (scene->turn.begun && guestsRun && (next == nullptr || scene->served < next->served))
          next = scene.get();
      if (next != nullptr) runSlice(*next);
    }
  }

 private:
  SimulatedScene& sceneOf(const TickSchedule* turn) {
    return **std::ranges::find_if(scenes_, [&](const auto& scene) { return &scene->turn == turn; });
  }

  std::vector<std::unique_ptr<SimulatedScene>> scenes_;
};

TEST(ShareOf, DividesThePeriodAmongRunningScenesAndOnceAmongAllGuests) {
  TickSchedule one(50), two(100), firstGuest(50, true), secondGuest(50, true);
  const TickSchedule* const all[] = {&one, &two, &firstGuest, &secondGuest};
  one.running = true;
  EXPECT_EQ(shareOf(one, all), 20ms);
  two.running = true;
  EXPECT_EQ(shareOf(one, all), 10ms);
  EXPECT_EQ(shareOf(two, all), 5ms);
  firstGuest.running = secondGuest.running = true;
  EXPECT_EQ(shareOf(two, all), 5ms);
  EXPECT_EQ(shareOf(firstGuest, all), Clock::duration(20ms) / 6);
  one.running = two.running = false;
  EXPECT_EQ(shareOf(firstGuest, all), 10ms);
}

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
  resting.turn.running = false;
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
  std::vector<SimulatedScene*> guests;
  for (int i = 0; i < 15; ++i) guests.push_back(&add(72, i < 14 ? 30ms : 3s, true));
  run(30s);
  EXPECT_EQ(own.slipped, 0);
  EXPECT_GE(own.ticks, 30 * 72 - 3);
  EXPECT_LE(own.worstLateness, 2 * kSlice);
  Clock::duration used{};
  for (const SimulatedScene* guest : guests) {
    EXPECT_GE(guest->ticks, 1);
    used += guest->ticks * guest->cost;
  }
  // Half of the device is theirs.
  EXPECT_GE(used, 30s / 2 - 3s);
}

TEST_F(TickSchedulerTest, GuestsUseTheTimeThatOtherScenesLeave) {
  for (int i = 0; i < 3; ++i) add(72, 1ms);
  SimulatedScene& guest = add(1000, 2ms, true);
  run(10s);
  EXPECT_GE(guest.ticks * guest.cost, 0.6 * 10s) << "its share is 0.25";
}

TEST_F(TickSchedulerTest, LongSlicesStayWithinTheShareOfGuests) {
  SimulatedScene &own = add(72, 3ms), &guest = add(10, 600ms, true);
  guest.slice = 12ms;  // own leaves gaps of 10.9 ms
  run(10s);
  EXPECT_GE(own.ticks, 0.99 * 720);
  EXPECT_NEAR(guest.ticks * seconds(guest.cost), 0.5 * 10, 0.6);
}

TEST_F(TickSchedulerTest, GuestsHaveTheWholeDeviceWithoutOtherScenes) {
  SimulatedScene &first = add(72, 40ms, true), &second = add(72, 40ms, true);
  run(10s);
  EXPECT_NEAR(first.ticks, second.ticks, 2);
  EXPECT_GE(first.ticks + second.ticks, 249);
}

}  // namespace
}  // namespace clothstream::schedule
