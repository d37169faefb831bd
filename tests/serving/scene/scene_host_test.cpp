// SPDX-License-Identifier: MIT
// Ticks of a scene, one at a time: inputs, determinism, and recovery.
#include "server/scene/scene_host.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <future>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "server/recording/scene_journal.h"
#include "server/scene/scene_loader.h"
#include "server/step/step.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/serving/scene/busy_scene.h"
#include "tests/serving/scene/hosted_scene.h"

namespace clothstream::scene {
namespace {

using namespace schedule;

using model::Vec3;
using tests::gravity;
using tests::handAt;
using tests::HostedScene;
using tests::smallScene;
using tests::wind;

class SceneHostTest : public tests::GpuTest {};

TEST_F(SceneHostTest, RefusesASceneThatLeavesTooFewAllocations) {
  vulkan::Device few({.maxAllocations = SceneOnDevice::kSpareAllocations});
  LiveScene live(smallScene());
  delivery::FramePublisher publisher;
  try {
    const SceneHost host(few, live, publisher);
    FAIL() << "accepted";
  } catch (const std::runtime_error& refused) {
    EXPECT_NE(std::string(refused.what()).find("allocations of memory"), std::string::npos) << refused.what();
  }
  EXPECT_EQ(few.allocatedBytes(), 0u);
}

TEST_F(SceneHostTest, SameInputsGiveTheSameStatesForAnySubscribers) {
  const auto simulate = [](std::size_t subscribers) {
    HostedScene hosted(smallScene(), subscribers);
    for (int tick = 0; tick < 60; ++tick) {
      if (tick == 10) hosted.change(wind(3));
      const float z = 0.01f * static_cast<float>(tick) - 0.3f;
      hosted.live.inbox.postPoses(
          9,
          {.colliders = {handAt(1, 0.1f, -0.6f, z)},
           .grabs = {{.id = 1, .pose = {model::Vec3(0, -0.4f, z), model::Quaternion::Identity()}}}},
          hosted.now);
      // Key-frame requests change what is sent, not what is simulated.
      if (tick % 7 == 0) hosted.mailboxes.back()->restart();
      hosted.tick();
    }
    return hosted.stateHashes();
  };
  const std::vector<std::uint64_t> alone = simulate(1);
  EXPECT_EQ(alone.size(), 60u);
  EXPECT_EQ(simulate(4), alone);
}

TEST_F(SceneHostTest, StartingARecordingChangesNoState) {
  e2e::TemporaryDirectory directory;
  const auto journal = std::make_shared<recording::SceneJournal>(
      "small", recording::RecorderOptions{.directory = directory.path(), .serverName = "test"}, false);
  const auto simulate = [](const std::shared_ptr<Journal>& recordedBy) {
    HostedScene hosted(
        smallScene(), 1, [](LiveScene&) {}, recordedBy);
    hosted.ticks(30);
    if (recordedBy) {
      EXPECT_TRUE(recordedBy->start("twin"));
    }
    hosted.change(wind(3));
    hosted.ticks(60);
    if (recordedBy) {
      EXPECT_TRUE(recordedBy->active());
    }
    return hosted.stateHashes();
  };
  const std::vector<std::uint64_t> unrecorded = simulate(nullptr);
  EXPECT_EQ(unrecorded.size(), 90u);
  EXPECT_EQ(simulate(journal), unrecorded);
}

TEST_F(SceneHostTest, SlicesOfATickGiveTheSameStates) {
  model::Scene scene = smallScene();
  model::Cloth& cloth = scene.cloths.front();
  cloth.grid.rows = cloth.grid.columns = 128;
  cloth.mass = 0.001f * static_cast<float>(cloth.nodeCount());
  const auto simulate = [&](double sliceScale, std::uint32_t& slices) {
    LiveScene live(scene);
    delivery::FramePublisher publisher;
    auto loaded = std::make_unique<SceneOnDevice>(tests::device(), scene, publisher.workers());
    for (int i = 0; i < 20; ++i) loaded->slices.scale(sliceScale);
    SceneHost host(std::move(loaded), live, publisher, 0);
    std::vector<std::uint64_t> states;
    for (int tick = 0; tick < 3; ++tick) {
      host.begin(Clock::now());
      for (host.submitSlice(); host.hasSlices(); ++slices) {
        host.waitForSlice();
        host.submitSlice();
      }
      host.finish();
      states.push_back(host.status().stateHash);
    }
    return states;
  };
  std::uint32_t many = 0, none = 0;
  EXPECT_EQ(simulate(0, many), simulate(2, none));
  EXPECT_GT(many, scene.substeps);
  EXPECT_EQ(none, 0u);
}

// Work that others submitted before the tick, such as kernels of a scene that is loaded.
TEST_F(SceneHostTest, WaitingForOtherWorkIsNotTimeOfTheTick) {
  HostedScene hosted;
  hosted.ticks(3);
  if (!hosted.host.deviceSeconds()) GTEST_SKIP() << "the device has no timestamps";
  constexpr std::size_t kBytes = 64u << 20;
  const vulkan::Buffer buffer(tests::device(), vulkan::BufferPurpose::state, kBytes);
  vulkan::Recorder other(tests::device());
  other.begin();
  other.beginStage("other");
  for (std::uint32_t fill = 0; fill < 40; ++fill) {
    other.fill(buffer, fill, kBytes);
    other.barrier();
  }
  const vulkan::TimelineValue submitted = tests::device().submit(other);
  hosted.tick();
  tests::device().wait(submitted);
  const double waited = other.stageTimes().front().seconds;
  EXPECT_GT(*hosted.host.deviceSeconds(), 0);
  EXPECT_LT(*hosted.host.deviceSeconds(), waited / 2);
  EXPECT_GE(*hosted.host.ownSeconds(), *hosted.host.deviceSeconds());
}

TEST_F(SceneHostTest, LessWorkSendsFewerFramesAndComputesFewerSubsteps) {
  HostedScene hosted;
  hosted.ticks(4);
  EXPECT_EQ(hosted.frames.size(), 4u);
  EXPECT_EQ(hosted.frames.back().frame_divisor(), 0u);
  hosted.announced.clear();
  hosted.host.setWork({.frameDivisor = 4, .substeps = 12});
  hosted.ticks(8);
  ASSERT_EQ(hosted.frames.size(), 6u);
  EXPECT_EQ(hosted.frames.back().frame_divisor(), 4u);
  EXPECT_EQ(hosted.live.metrics.overloadStepsDown.value(), 1u);
  ASSERT_EQ(hosted.announced.size(), 1u);
  const v1::Notice& notice = hosted.announced.front().notice();
  EXPECT_EQ(notice.kind(), v1::NOTICE_KIND_LOAD_CHANGED);
  EXPECT_EQ(notice.tick(), 5u);
  EXPECT_EQ(notice.text(),
            "the device is overloaded: the scene sends 10 of 40 frames/s and computes 12 of 12 substeps");
  hosted.host.setWork({.frameDivisor = 4, .substeps = 6});
  hosted.ticks(4);
  EXPECT_EQ(hosted.live.work.load(), (WorkLevel{4, 6}));
  EXPECT_EQ(hosted.live.metrics.overloadStepsDown.value(), 2u);
  hosted.host.setWork(hosted.live.allWork());
  hosted.tick();
  EXPECT_EQ(hosted.frames.size(), 8u);
  EXPECT_EQ(hosted.live.metrics.overloadStepsUp.value(), 1u);
  EXPECT_EQ(hosted.announced.back().notice().text(),
            "the device is no longer overloaded: the scene has all frames and substeps again");
}

// The same inputs with and without fewer substeps, and with fewer frames.
TEST_F(SceneHostTest, OnlySubstepsChangeTheStates) {
  const auto simulate = [](const WorkLevel& work) {
    HostedScene hosted;
    hosted.host.setWork(work);
    hosted.ticks(40);
    return hosted.host.status().stateHash;
  };
  const std::uint64_t all = simulate({1, 12});
  EXPECT_EQ(simulate({4, 12}), all);
  EXPECT_NE(simulate({1, 6}), all);
}

TEST_F(SceneHostTest, SubstepsStayWithinTheStabilityBoundOfThePresentParameters) {
  model::Scene scene = smallScene();
  scene.substeps = 40;
  HostedScene hosted(scene);
  const std::uint32_t least = hosted.host.leastSubsteps();
  ASSERT_GT(least, 1u);
  ASSERT_LT(least, 20u);
  hosted.host.setWork({1, 1});
  hosted.tick();
  EXPECT_EQ(hosted.live.work.load().substeps, least);
  model::ParameterChange stiffer;
  stiffer.cloths.push_back({.numbers = {{parameters::ClothNumber::structuralStiffness, 20.0f}}});
  hosted.change(stiffer);
  hosted.tick();
  const std::uint32_t more = hosted.live.work.load().substeps;
  EXPECT_GT(more, least);
  EXPECT_LT(more, 40u);
  hosted.ticks(80);
  EXPECT_TRUE(hosted.host.status().healthy);
  EXPECT_EQ(hosted.live.metrics.rollbacks.value(), 0u);
}

model::ParameterChange constraints(std::uint32_t iterations) {
  model::ParameterChange change;
  model::Solver solver;
  solver.kind = model::SolverKind::constraint;
  solver.iterations = iterations;
  change.cloths.push_back({.solver = solver});
  return change;
}

TEST_F(SceneHostTest, ChangesOfOneTickMakeStagesOnce) {
  const model::Scene scene = smallScene();
  LiveScene live(scene);
  delivery::FramePublisher publisher;
  auto loaded = std::make_unique<SceneOnDevice>(tests::device(), scene, publisher.workers());
  const auto& simulation = loaded->simulation;
  SceneHost host(std::move(loaded), live, publisher, 0);
  const auto tick = [&] {
    host.begin(Clock::now());
    host.finish();
    publisher.drain();
  };
  tick();
  const std::uint64_t made = simulation.stagesMade();
  for (const std::uint32_t iterations : {3u, 4u, 5u})
    ASSERT_TRUE(live.inbox.postChange({.participant = 5, .change = constraints(iterations)}));
  tick();
  EXPECT_EQ(live.inbox.depth().changes, 0u);
  EXPECT_EQ(simulation.stagesMade(), made + 1);
}

TEST_F(SceneHostTest, ChangesOfOneTickActTogether) {
  HostedScene hosted;
  hosted.tick();
  hosted.announced.clear();
  for (const std::uint32_t iterations : {3u, 4u, 5u}) hosted.change(constraints(iterations));
  hosted.change(wind(1));
  hosted.tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 0u);
  EXPECT_GT(hosted.host.makingTime(), Clock::duration::zero());
  std::vector<std::uint64_t> ticks;
  for (const v1::ServerMessage& message : hosted.announced)
    if (message.has_parameter_changed()) ticks.push_back(message.parameter_changed().tick());
  EXPECT_EQ(ticks, std::vector<std::uint64_t>(4, 2u));
}

// The clock stands still, so the budget does not refill. Changes are sent until one has to wait.
TEST_F(SceneHostTest, ChangesThatMakeStagesWaitUntilEarlierOnesArePaidFor) {
  HostedScene hosted;
  hosted.tick();
  const auto tickAtOnce = [&] {
    hosted.now -= std::chrono::seconds(1);
    hosted.tick();
  };
  for (std::uint32_t iterations = 1; iterations < 10'000 && hosted.live.inbox.depth().changes == 0;
       ++iterations) {
    hosted.change(constraints(iterations));
    tickAtOnce();
  }
  ASSERT_EQ(hosted.live.inbox.depth().changes, 1u);
  hosted.change(wind(1));
  tickAtOnce();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 2u) << "later changes keep their place";
  hosted.now += std::chrono::minutes(10);
  hosted.tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 0u);
}

// Longer than earlier changes of a test have to be paid for, however slow the machine is.
constexpr std::chrono::minutes kUntilPaid{10};

// A change of a solver waits for its kernels, which are compiled beside the ticks.
TEST_F(SceneHostTest, ChangesThatMakeStagesAreRehearsed) {
  HostedScene hosted;
  std::promise<void> gate;
  std::shared_future<void> opened = gate.get_future().share();
  SceneLoader loader(hosted.publisher.workers(), [opened] { opened.wait(); });
  SceneHost host(std::make_unique<SceneOnDevice>(tests::device(), smallScene(), hosted.publisher.workers()),
                 hosted.live, hosted.publisher, 0, &loader);
  const auto tick = [&] {
    host.begin(hosted.now += kUntilPaid);
    host.finish();
    hosted.publisher.drain();
  };
  // The loader's thread is busy until the gate opens.
  const SceneLoader::Future other = loader.load(tests::device(), smallScene(), {});
  hosted.change(wind(1));
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 0u) << "it needs no kernels";
  hosted.change(constraints(3));
  for (int i = 0; i < 3; ++i) tick();
  hosted.change(wind(2));
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 2u);
  EXPECT_TRUE(host.isRehearsing());
  gate.set_value();
  loader.wait();
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 1u) << "the rehearsed one has acted";
  EXPECT_FALSE(host.isRehearsing());
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 0u);
}

// The scene that the rehearsal was for does not come.
TEST_F(SceneHostTest, AnotherChangeThanTheRehearsedOneIsRehearsedToo) {
  HostedScene hosted;
  SceneLoader loader(hosted.publisher.workers(), [] {});
  SceneHost host(std::make_unique<SceneOnDevice>(tests::device(), smallScene(), hosted.publisher.workers()),
                 hosted.live, hosted.publisher, 0, &loader);
  const auto tick = [&] {
    host.begin(hosted.now += kUntilPaid);
    host.finish();
    hosted.publisher.drain();
    loader.wait();
  };
  hosted.change(constraints(3));
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 1u);
  hosted.live.inbox.dropChanges();
  hosted.change(constraints(4));
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 1u) << "it waits for its own rehearsal";
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 0u);
}

TEST_F(SceneHostTest, UnneededRehearsalFreesItsDeviceMemory) {
  HostedScene hosted;
  SceneLoader loader(hosted.publisher.workers(), [] {});
  SceneHost host(std::make_unique<SceneOnDevice>(tests::device(), smallScene(), hosted.publisher.workers()),
                 hosted.live, hosted.publisher, 0, &loader);
  const auto tick = [&] {
    host.begin(hosted.now += kUntilPaid);
    host.finish();
    hosted.publisher.drain();
  };
  tick();
  const std::uint64_t before = tests::device().allocatedBytes();
  hosted.change(constraints(3));
  tick();
  hosted.change({.cloths = {{.solver = smallScene().cloths[0].solver}}});
  tick();
  EXPECT_EQ(hosted.live.inbox.depth().changes, 0u) << "both together need nothing";
  loader.wait();
  tick();
  EXPECT_FALSE(host.isRehearsing());
  EXPECT_EQ(tests::device().allocatedBytes(), before);
}

TEST_F(SceneHostTest, ChangesOfSolversToAndFroDoNotWait) {
  HostedScene hosted;
  for (std::uint32_t i = 0; i < 20; ++i) {
    hosted.change(constraints(3 + i % 2));
    hosted.now += i < 2 ? std::chrono::seconds(kUntilPaid) : std::chrono::seconds(-1);
    hosted.tick();
    EXPECT_EQ(hosted.live.inbox.depth().changes, 0u);
  }
}

TEST_F(SceneHostTest, HandIsPlacedAtTheTimeOfTheTick) {
  HostedScene hosted;
  const auto pose = [&](std::chrono::milliseconds beyondTick, float x) {
    const Clock::time_point trueAt = hosted.now + std::chrono::seconds(1) + beyondTick;
    hosted.live.inbox.postPoses(9, {.colliders = {handAt(1, x, 5, 0)}}, hosted.now,
                                {.trueAt = trueAt, .clientTimeUs = microseconds(trueAt)});
  };
  pose(std::chrono::milliseconds(-30), 1);
  pose(std::chrono::milliseconds(10), 1.4f);
  hosted.tick();
  ASSERT_EQ(hosted.frames.back().colliders_size(), 2);
  EXPECT_NEAR(hosted.frames.back().colliders(1).position().x(), 1.3f, 1e-5f);
  hosted.tick();  // a second later
  EXPECT_EQ(hosted.frames.back().colliders(1).position().x(), 1.4f);
}

TEST_F(SceneHostTest, ChangeActsAndIsAnnouncedAtTheNextTick) {
  HostedScene changed, unchanged;
  changed.ticks(5);
  unchanged.ticks(5);
  v1::ParameterChange message;
  message.mutable_gravity()->mutable_value()->set_y(-2);
  ASSERT_TRUE(changed.live.change(42, message, Role::owner));
  EXPECT_EQ(changed.live.definition().environment.gravity.y(), -2);
  changed.tick();
  unchanged.tick();
  EXPECT_EQ(changed.frames[4].state_hash(), unchanged.frames[4].state_hash());
  EXPECT_NE(changed.frames[5].state_hash(), unchanged.frames[5].state_hash());
  ASSERT_EQ(changed.announced.size(), 1u);
  ASSERT_TRUE(changed.announced[0].has_parameter_changed());
  EXPECT_EQ(changed.announced[0].parameter_changed().participant_id(), 42u);
  EXPECT_EQ(changed.announced[0].parameter_changed().tick(), 6u);
  EXPECT_EQ(changed.announced[0].parameter_changed().change().gravity().value().y(), -2);
}

// Events of a grab at the middle of the lower edge: taken, slipped, released.
TEST_F(SceneHostTest, AnnouncesGrabEvents) {
  HostedScene hosted;
  const auto grabAt = [&](Vec3 place) {
    hosted.live.inbox.postPoses(
        7, {.grabs = {{.id = 3, .pose = {place, model::Quaternion::Identity()}, .radius = 0.06f}}},
        hosted.now);
    hosted.tick();
  };
  const auto newest = [&] {
    v1::TickEvents events =
        hosted.announced.empty() ? v1::TickEvents() : hosted.announced.back().tick_events();
    hosted.announced.clear();
    return events;
  };
  grabAt(Vec3(0.05f, -1.1f, 0));
  const v1::TickEvents taken = newest();
  ASSERT_EQ(taken.grabs_size(), 1);
  EXPECT_EQ(taken.tick(), 1u);
  EXPECT_EQ(taken.grabs(0).participant_id(), 7u);
  EXPECT_EQ(taken.grabs(0).grab_id(), 3u);
  EXPECT_EQ(taken.grabs(0).kind(), v1::GRAB_EVENT_KIND_TAKEN);
  EXPECT_EQ(taken.grabs(0).vertices(), 1u);
  hosted.ticks(3);
  EXPECT_EQ(newest().grabs_size(), 0);
  // It follows its hand at kMaxHandSpeed, so it slips some ticks later.
  grabAt(Vec3(0.05f, -1.1f, 3));
  v1::TickEvents slipped = newest();
  for (int tick = 0; tick < 10 && slipped.grabs_size() == 0; ++tick) {
    hosted.tick();
    slipped = newest();
  }
  ASSERT_EQ(slipped.grabs_size(), 1);
  EXPECT_EQ(slipped.grabs(0).kind(), v1::GRAB_EVENT_KIND_SLIPPED);
  EXPECT_EQ(slipped.grabs(0).vertices(), 0u);
  hosted.live.inbox.postPoses(7, {}, hosted.now);
  hosted.tick();
  const v1::TickEvents released = newest();
  ASSERT_EQ(released.grabs_size(), 1);
  EXPECT_EQ(released.grabs(0).kind(), v1::GRAB_EVENT_KIND_RELEASED);

  // A grab far from the cloth takes no node.
  grabAt(Vec3(10, 0, 0));
  const v1::TickEvents nothing = newest();
  ASSERT_EQ(nothing.grabs_size(), 1);
  EXPECT_EQ(nothing.grabs(0).kind(), v1::GRAB_EVENT_KIND_TAKEN);
  EXPECT_EQ(nothing.grabs(0).vertices(), 0u);
}

// The cloth is 0.4 m from the hand by the time the server hears of the grab. A grab without a place finds
// nothing.
TEST_F(SceneHostTest, DrawsTheSeenPlaceToTheHandWithinAFifthOfASecond) {
  HostedScene hosted;
  hosted.ticks(20);
  constexpr std::uint32_t kNode = 10 * 11 + 5;           // in the lowest row
  constexpr std::uint32_t kTriangle = 2 * (9 * 10 + 5);  // its second corner is that node
  const auto place = [&] { return Eigen::Map<const Vec3>(hosted.decoder->positions().data() + 3 * kNode); };
  const Vec3 seen = place();
  const Vec3 hand = seen + Vec3(0, 0, 0.4f);
  model::Grab grab{.id = 3, .pose = {hand, model::Quaternion::Identity()}, .radius = 0.05f};
  hosted.live.inbox.postPoses(7, {.grabs = {grab}}, hosted.now);
  hosted.announced.clear();
  hosted.tick();
  ASSERT_FALSE(hosted.announced.empty());
  EXPECT_EQ(hosted.announced.back().tick_events().grabs(0).vertices(), 0u);

  grab.id = 4;
  grab.place = model::GrabPlace{.point = {.triangle = kTriangle, .second = 1}, .seenTick = 12};
  hosted.live.inbox.postPoses(7, {.grabs = {grab}}, hosted.now);
  hosted.announced.clear();
  hosted.ticks(1);
  ASSERT_FALSE(hosted.announced.empty());
  const v1::TickEvents& events = hosted.announced.back().tick_events();
  const v1::GrabEvent& taken = events.grabs(events.grabs_size() - 1);
  EXPECT_EQ(taken.grab_id(), 4u);
  EXPECT_EQ(taken.kind(), v1::GRAB_EVENT_KIND_TAKEN);
  EXPECT_GT(taken.vertices(), 0u);
  EXPECT_NEAR(taken.distance(), 0.4, 0.05);  // the cloth has moved a little since
  EXPECT_EQ(taken.ticks_since_seen(), 10u);
  hosted.announced.clear();
  hosted.ticks(7);  // 0.2 s with the first one
  EXPECT_LT((place() - hand).norm(), 0.05f);
  for (const v1::ServerMessage& message : hosted.announced)
    EXPECT_EQ(message.tick_events().grabs_size(), 0) << "slipped";
}

// A hand is in the sheet for ten ticks and then moves away. The scene's ball does not touch the sheet.
TEST_F(SceneHostTest, AnnouncesContactsIfRequested) {
  model::Scene scene = smallScene();
  scene.colliders[0].motion.keys.clear();
  scene.colliders[0].pose.position = Vec3(0, -0.5f, 3);
  HostedScene hosted(scene);
  const auto contacts = [&] {
    std::vector<v1::ContactEvent> events;
    for (const v1::ServerMessage& message : hosted.announced)
      events.insert(events.end(), message.tick_events().contacts().begin(),
                    message.tick_events().contacts().end());
    hosted.announced.clear();
    return events;
  };
  const auto touch = [&](bool wants) {
    hosted.live.inbox.postPoses(7, {.colliders = {handAt(4, 0, -0.6f, 0.05f)}, .wantsContacts = wants},
                                hosted.now);
    hosted.ticks(10);
    hosted.live.inbox.postPoses(7, {.colliders = {handAt(4, 5)}, .wantsContacts = wants}, hosted.now);
    hosted.ticks(5);
  };
  touch(false);
  EXPECT_TRUE(contacts().empty());
  touch(true);
  const std::vector<v1::ContactEvent> events = contacts();
  ASSERT_GE(events.size(), 2u);
  EXPECT_EQ(events.size() % 2, 0u);
  for (std::size_t i = 0; i < events.size(); ++i) {
    EXPECT_EQ(events[i].kind(), i % 2 == 0 ? v1::CONTACT_EVENT_KIND_BEGAN : v1::CONTACT_EVENT_KIND_ENDED);
    EXPECT_EQ(events[i].participant_id(), 7u);
    EXPECT_EQ(events[i].collider_id(), 4u);
    EXPECT_EQ(events[i].collider(), "");
    EXPECT_EQ(events[i].cloth(), "sheet");
    EXPECT_GT(events[i].impulse(), 0);
  }
  EXPECT_GT(events[1].seconds(), 0);
  EXPECT_LE(events[1].seconds(), 10.0f / 40 + 1e-6f);
  // A participant that leaves no longer requests events.
  hosted.live.inbox.postPoses(7, {}, hosted.now);
  hosted.tick();
  hosted.live.inbox.postPoses(8, {.colliders = {handAt(1, 0, -0.6f, 0.05f)}}, hosted.now);
  hosted.ticks(5);
  EXPECT_TRUE(contacts().empty());
}

TEST_F(SceneHostTest, SpringChangesReachTheDevice) {
  HostedScene changed, unchanged;
  model::ParameterChange softer;
  softer.cloths.push_back({.numbers = {{parameters::ClothNumber::structuralStiffness, 1.0f},
                                       {parameters::ClothNumber::structuralDamping, 0.001f}}});
  changed.tick();
  changed.change(softer);
  changed.ticks(2);
  unchanged.ticks(3);
  ASSERT_EQ(changed.frames.size(), 3u);
  ASSERT_EQ(unchanged.frames.size(), 3u);
  EXPECT_NE(changed.frames[2].state_hash(), unchanged.frames[2].state_hash());
}

TEST_F(SceneHostTest, UnhealthyStateIsNotSentAndRollsBack) {
  HostedScene hosted;
  hosted.ticks(90);  // 40 ticks/s: the state was saved at ticks 40 and 80
  ASSERT_EQ(hosted.frames.size(), 90u);
  hosted.change(gravity(-1e30f));  // messages cannot carry this value
  hosted.tick();
  EXPECT_FALSE(hosted.host.status().healthy);
  EXPECT_EQ(hosted.frames.size(), 90u);
  ASSERT_EQ(hosted.announced.size(), 2u);  // the change, and the notice
  EXPECT_EQ(hosted.announced[1].notice().kind(), v1::NOTICE_KIND_ROLLED_BACK);
  EXPECT_EQ(hosted.live.metrics.rollbacks.value(), 1u);

  hosted.change(gravity(-9.81f));
  hosted.tick();
  EXPECT_TRUE(hosted.host.status().healthy);
  ASSERT_EQ(hosted.frames.size(), 91u);
  EXPECT_TRUE(hosted.keys.back());
  EXPECT_EQ(hosted.decoder->tick(), 92u);  // the numbers of ticks continue
  hosted.tick();
  EXPECT_FALSE(hosted.keys.back());
  EXPECT_EQ(hosted.live.metrics.resets.value(), 0u);
}

TEST_F(SceneHostTest, RollsBackClothThatLeavesTheRangeOfTheStream) {
  model::Scene scene = smallScene();
  scene.stream.maxError = 0.00005f;  // 49.65 m
  scene.cloths[0].pins.clear();
  scene.cloths[0].drag = scene.cloths[0].lift = 0;
  HostedScene hosted(scene);
  hosted.ticks(50);
  hosted.change(gravity(-1000));
  int ticks = 0;
  while (hosted.live.metrics.rollbacks.value() == 0) {
    ASSERT_LT(++ticks, 100);
    hosted.tick();
  }
  EXPECT_TRUE(hosted.host.status().outOfReach);
  for (const v1::Frame& frame : hosted.frames) EXPECT_NE(frame.state_hash(), hosted.host.status().stateHash);
  for (const float coordinate : hosted.decoder->positions()) EXPECT_LT(std::abs(coordinate), 49.7f);
  const v1::Notice& notice = hosted.announced.back().notice();
  EXPECT_EQ(notice.kind(), v1::NOTICE_KIND_ROLLED_BACK);
  EXPECT_EQ(
      notice.text(),
      "cloth left the range that the stream holds, 49.65 m from (0, 0, 0) along each axis at a maxError of "
      "5e-05 m: the scene continues from its newest healthy state, at most a second old");
}

TEST_F(SceneHostTest, SecondUnhealthyStateResetsTheClothsAndUndoesNewChanges) {
  HostedScene hosted;
  hosted.ticks(50);
  hosted.change(gravity(-1e30f));
  hosted.change(wind(1));
  hosted.ticks(2);  // the second tick starts from the checkpoint, with the same gravity
  EXPECT_EQ(hosted.live.metrics.rollbacks.value(), 1u);
  EXPECT_EQ(hosted.live.metrics.resets.value(), 1u);
  hosted.ticks(30);
  EXPECT_TRUE(hosted.host.status().healthy);
  EXPECT_EQ(hosted.frames.size(), 80u);
  EXPECT_EQ(hosted.live.definition().environment.wind, Vec3(0, 0, 0));
  const v1::ServerMessage& reset = hosted.announced.at(hosted.announced.size() - 2);
  ASSERT_TRUE(reset.has_parameter_changed());
  EXPECT_EQ(reset.parameter_changed().participant_id(), 0u);
  EXPECT_NEAR(reset.parameter_changed().change().gravity().value().y(), -9.81, 1e-6);
  EXPECT_EQ(hosted.announced.back().notice().kind(), v1::NOTICE_KIND_ROLLED_BACK);
}

// The wind changes twice a second. Only changes of the newest two seconds are undone.
TEST_F(SceneHostTest, UndoesOnlyNewChangesOfParametersThatChangeAllTheTime) {
  HostedScene hosted;
  for (int i = 1; i <= 6; ++i) {
    hosted.change(wind(static_cast<float>(i)));
    hosted.ticks(20);
  }
  hosted.change(gravity(-1e30f));
  hosted.ticks(2);
  EXPECT_EQ(hosted.live.metrics.resets.value(), 1u);
  const model::Environment undone = hosted.live.definition().environment;
  EXPECT_GE(undone.wind.x(), 4);
  EXPECT_NEAR(undone.gravity.y(), -9.81f, 1e-5f);
  hosted.tick();
  EXPECT_TRUE(hosted.host.status().healthy);
}

// An earlier run of the server ended before a second had passed since the changes.
TEST_F(SceneHostTest, ParametersOfARestoredSceneAreNotProven) {
  HostedScene hosted(smallScene(), 1, [](LiveScene& live) {
    SavedScene saved{.start = smallScene(), .accepted = smallScene()};
    saved.accepted->environment.gravity.y() = -1e30f;
    live.restore(std::move(saved), {}, Clock::now());
  });
  hosted.ticks(2);
  EXPECT_EQ(hosted.live.metrics.resets.value(), 1u);
  EXPECT_NEAR(hosted.live.definition().environment.gravity.y(), -9.81f, 1e-5f);
  hosted.tick();
  EXPECT_TRUE(hosted.host.status().healthy);
}

TEST_F(SceneHostTest, UndoneChangesBringNoEasedCorrectionBack) {
  HostedScene hosted(smallScene(), 1, [](LiveScene& live) {
    SavedScene saved{.start = smallScene(), .accepted = smallScene()};
    saved.accepted->cloths[0].solver.kind = model::SolverKind::constraint;
    live.restore(std::move(saved), {}, Clock::now());
  });
  hosted.ticks(60);
  hosted.change(gravity(-1e30f));
  hosted.ticks(2);
  EXPECT_EQ(hosted.live.metrics.resets.value(), 1u);
  const model::Solver undone = hosted.live.definition().cloths[0].solver;
  EXPECT_EQ(undone.kind, model::SolverKind::constraint);
  EXPECT_FALSE(undone.correctionFraction);
}

TEST_F(SceneHostTest, HandsThatMakeTheStateUnhealthyCostNoParameter) {
  HostedScene hosted;
  hosted.change(wind(7));
  hosted.ticks(50);
  hosted.announced.clear();
  const auto grabAt = [&](float x) {
    hosted.live.inbox.postPoses(
        9, {.grabs = {{.id = 1, .pose = {Vec3(x, -0.5f, 0), model::Quaternion::Identity()}, .radius = 0.5f}}},
        hosted.now);
    hosted.tick();
  };
  grabAt(0);
  EXPECT_TRUE(hosted.host.status().healthy);
  for (int i = 0; i < 60; ++i) grabAt(i % 2 == 0 ? NAN : 0);  // messages cannot carry it
  EXPECT_GE(hosted.live.metrics.resets.value(), 1u);
  hosted.live.inbox.postPoses(9, {}, hosted.now);
  hosted.ticks(50);
  EXPECT_TRUE(hosted.host.status().healthy);
  for (const v1::ServerMessage& message : hosted.announced) EXPECT_FALSE(message.has_parameter_changed());
}

TEST_F(SceneHostTest, ContinuesOnAnotherDeviceFromTheNewestSnapshot) {
  HostedScene hosted;
  hosted.ticks(210);  // 40 ticks/s: saved with tick 201
  hosted.host.release();
  vulkan::Device another(vulkan::DeviceOptions{.validation = true});
  hosted.host.rebuild(
      std::make_unique<SceneOnDevice>(another, hosted.live.start(), hosted.publisher.workers()),
      "the device was lost");
  hosted.tick();
  ASSERT_EQ(hosted.announced.size(), 1u);
  EXPECT_EQ(hosted.announced[0].notice().kind(), v1::NOTICE_KIND_DEVICE_REBUILT);
  EXPECT_TRUE(hosted.keys.back());
  EXPECT_EQ(hosted.decoder->tick(), 211u);

  // A separate scene that starts from the state of tick 201, with the same collider, gets the same bits.
  simulation::ClothSimulation simulation(another, hosted.live.start());
  ColliderSet colliders(hosted.live.start());
  simulation::TickInputs inputs{.environment = hosted.live.start().environment, .colliders = {}};
  vulkan::Recorder recorder(another);
  const auto tick = [&](int number) {
    colliders.advance(hosted.live.start(), number * hosted.live.start().tickSeconds(), inputs.colliders);
    recorder.begin();
    simulation.recordTick(recorder, inputs);
    simulation.recordSaveState(recorder);
    tests::submitAndWait(another, recorder);
  };
  for (int number = 1; number <= 201; ++number) tick(number);
  EXPECT_EQ(simulation.status().stateHash, hosted.frames.at(200).state_hash());
  const simulation::StateSnapshot saved = simulation.collectState(201);
  for (int number = 202; number <= 210; ++number) tick(number);
  recorder.begin();
  simulation.recordRestoreState(recorder, saved);
  tests::submitAndWait(another, recorder);
  tick(211);
  EXPECT_EQ(simulation.status().stateHash, hosted.frames.back().state_hash());
  hosted.publisher.drain();
  hosted.host.release();  // before its device
}

// A snapshot is saved with tick 201, while two grabs hold and a change of solver is eased.
TEST_F(SceneHostTest, LosingTheDeviceChangesNoLaterState) {
  const model::Scene scene = tests::busyScene(model::SolverKind::acad);
  HostedScene lost(scene), whole(scene);
  for (int number = 1; number <= 201; ++number) tests::busyTick(lost);
  lost.host.release();
  lost.host.rebuild(
      std::make_unique<SceneOnDevice>(tests::device(), lost.live.start(), lost.publisher.workers()),
      "the device was lost");
  for (int number = 202; number <= 230; ++number) tests::busyTick(lost);
  for (int number = 1; number <= 230; ++number) tests::busyTick(whole);
  EXPECT_EQ(lost.stateHashes(), whole.stateHashes());
  EXPECT_TRUE(lost.host.status().healthy);
}

// Returns the largest stretch of a column, m: its length along the springs minus its length at rest. Appends
// the heights of the lowest row to `heights`.
double stretchedBy(const std::vector<float>& positions, std::vector<float>* heights = nullptr) {
  double most = 0;
  for (std::size_t column = 0; column < 10; ++column) {
    double length = 0;
    for (std::size_t row = 0; row + 1 < 12; ++row) {
      const float* a = positions.data() + 3 * (10 * row + column);
      const float* b = a + 30;
      length += std::hypot(double{b[0]} - a[0], double{b[1]} - a[1], double{b[2]} - a[2]);
    }
    most = std::max(most, length - 1.1);
    if (heights != nullptr) heights->push_back(positions[3 * (110 + column) + 1]);
  }
  return most;
}

// Soft springs hang stretched by S metres. The correction fraction makes the stretch decay as exp(-t / 0.1
// s): a tick of 25 ms removes less than a quarter of S. The nodes' other motion adds at most 2 cm.
TEST_F(SceneHostTest, SolverChangeActsAtTheNextTickWithoutAJump) {
  model::Scene scene = smallScene();
  scene.colliders.clear();
  scene.cloths[0].damping = 3;
  scene.cloths[0].structural.stiffness = 0.7f;
  scene.cloths[0].shear.stiffness = 0.5f;
  HostedScene hosted(scene);
  hosted.ticks(120);
  const auto lowest = [&] {
    std::vector<float> heights;
    const std::vector<float> positions(hosted.decoder->positions().begin(),
                                       hosted.decoder->positions().end());
    stretchedBy(positions, &heights);
    return heights;
  };
  const auto stretch = [&] {
    return stretchedBy({hosted.decoder->positions().begin(), hosted.decoder->positions().end()});
  };
  const double before = stretch();
  ASSERT_GT(before, 0.2);
  model::ParameterChange change;
  model::Solver constraint;
  constraint.kind = model::SolverKind::constraint;
  change.cloths = {{.name = "sheet", .solver = constraint}};
  hosted.change(change);
  std::vector<float> was = lowest();
  for (int tick = 0; tick < 40; ++tick) {
    hosted.tick();
    const std::vector<float> now = lowest();
    for (std::size_t i = 0; i < now.size(); ++i)
      ASSERT_LT(std::abs(now[i] - was[i]), 0.25 * before + 0.02) << "tick " << tick;
    was = now;
  }
  EXPECT_TRUE(hosted.host.status().healthy);
  EXPECT_LT(stretch(), 0.02);
  ASSERT_FALSE(hosted.announced.empty());
  EXPECT_EQ(hosted.announced.back().parameter_changed().participant_id(), 5u);
}

TEST_F(SceneHostTest, StatesEqualThoseOfTheStepCommand) {
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / ("clothstream-stepped-" + std::to_string(getpid()) + ".f32");
  ASSERT_EQ(step::run(tests::device(), smallScene(), {.ticks = 30, .out = out}, [] { return false; }),
            step::Outcome::complete);
  const auto said = nlohmann::json::parse(std::ifstream(out.string() + ".json"));
  std::filesystem::remove(out);
  std::filesystem::remove(out.string() + ".json");
  HostedScene hosted;
  hosted.ticks(30);
  ASSERT_EQ(hosted.frames.size(), 30u);
  for (std::size_t i = 0; i < 30; ++i)
    EXPECT_EQ(said["hashes"][i + 1], fmt::format("{:016x}", hosted.frames[i].state_hash()))
        << "tick " << i + 1;
}

}  // namespace
}  // namespace clothstream::scene
