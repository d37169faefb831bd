// SPDX-License-Identifier: MIT
#include "server/hosting/scene_movement.h"

#include <chrono>
#include <future>
#include <optional>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

namespace clothstream::hosting {
namespace {

using enum SceneState;

template <class Value>
bool isReady(const std::future<Value>& future) {
  return future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

const std::exception_ptr kProblem = std::make_exception_ptr(std::runtime_error("problem"));

class ArrivalTest : public ::testing::Test {
 protected:
  std::future<void> begin(bool waits) {
    std::promise<void> ready;
    std::future<void> whenReady = ready.get_future();
    arrival.begin(std::move(ready), waits);
    return whenReady;
  }

  Arrival arrival;
};

TEST_F(ArrivalTest, AddedSceneIsNeededUntilLoaded) {
  EXPECT_FALSE(arrival.isUnderWay());
  const std::future<void> added = begin(false);
  EXPECT_TRUE(arrival.isUnderWay());
  EXPECT_FALSE(isReady(added));
  arrival.succeed();
  EXPECT_TRUE(isReady(added));
  EXPECT_FALSE(arrival.isUnderWay());
  arrival.succeed();  // nothing waits when it is loaded again
}

TEST_F(ArrivalTest, PreparedSceneIsNeededUntilStarted) {
  const std::future<void> prepared = begin(true);
  arrival.succeed();
  EXPECT_TRUE(isReady(prepared));
  EXPECT_TRUE(arrival.waits());
  EXPECT_TRUE(arrival.isUnderWay());
  std::promise<void> start;
  std::future<void> started = start.get_future();
  arrival.start(std::move(start));
  EXPECT_FALSE(arrival.waits());
  EXPECT_TRUE(arrival.isUnderWay());
  arrival.succeed();
  started.get();
  EXPECT_FALSE(arrival.isUnderWay());
}

TEST_F(ArrivalTest, CallerLearnsOfFailureOnce) {
  EXPECT_FALSE(arrival.fail(kProblem));
  std::future<void> added = begin(false);
  EXPECT_TRUE(arrival.fail(kProblem));
  EXPECT_THROW(added.get(), std::runtime_error);
  EXPECT_FALSE(arrival.fail(kProblem));
}

class DepartureTest : public ::testing::Test {
 protected:
  std::future<Departure::State> request(bool holds, std::uint64_t tick) {
    std::promise<Departure::State> state;
    std::future<Departure::State> whenRead = state.get_future();
    departure.request(std::move(state), holds, tick);
    return whenRead;
  }

  Departure departure;
};

TEST_F(DepartureTest, NothingIsDueWithoutRequest) {
  EXPECT_FALSE(departure.isDue(idle, 5));
  EXPECT_FALSE(departure.isBusy());
}

TEST_F(DepartureTest, RunningSceneFirstReachesTheTick) {
  const std::future<Departure::State> held = request(true, 6);
  EXPECT_TRUE(departure.isBusy());
  EXPECT_FALSE(departure.isDue(running, 5));
  EXPECT_FALSE(departure.isDue(inFlight, 6));
  EXPECT_FALSE(departure.isDue(betweenSlices, 6));
  EXPECT_TRUE(departure.isDue(running, 6));
}

TEST_F(DepartureTest, OtherScenesAnswerUnlessTheyLoad) {
  const std::future<Departure::State> held = request(true, 6);
  for (const SceneState state : {asleep, idle, paused, interrupted, quarantined})
    EXPECT_TRUE(departure.isDue(state, 5));
  EXPECT_FALSE(departure.isDue(loading, 5));
}

TEST_F(DepartureTest, HeldSceneTakesNoRequests) {
  std::future<Departure::State> state = request(true, 6);
  EXPECT_FALSE(departure.isHeld());
  departure.give(std::nullopt);
  EXPECT_FALSE(state.get().has_value());
  EXPECT_TRUE(departure.isHeld());
  EXPECT_TRUE(departure.isBusy());
  departure.release();
  EXPECT_FALSE(departure.isBusy());
}

TEST_F(DepartureTest, SceneThatIsReadGoesOn) {
  std::future<Departure::State> state = request(false, 0);
  EXPECT_TRUE(departure.isDue(running, 0));
  departure.give(std::nullopt);
  EXPECT_TRUE(isReady(state));
  EXPECT_FALSE(departure.isHeld());
  EXPECT_FALSE(departure.isBusy());
}

TEST_F(DepartureTest, SceneGoesOnAfterAFailure) {
  std::future<Departure::State> state = request(true, 6);
  departure.fail(kProblem);
  EXPECT_THROW(state.get(), std::runtime_error);
  EXPECT_FALSE(departure.isHeld());
  EXPECT_FALSE(departure.isBusy());
}

}  // namespace
}  // namespace clothstream::hosting
