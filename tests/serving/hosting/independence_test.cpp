// SPDX-License-Identifier: MIT
// Scenes in company have the bits that each has alone.
//
// Scenes are recorded while they run together. A recording has the inputs of every tick and the hash of the
// state after it, and is simulated again alone.
#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/delivery/envelope.h"
#include "server/messages/solver_message.h"
#include "server/recording/recordings.h"
#include "server/recording/resimulate.h"
#include "server/scene/checkpoint.h"
#include "server/scene/live_scene.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/serving/hosting/varied_scenes.h"
#include "tests/serving/server_test.h"
#include "tests/serving/small_scene.h"

namespace clothstream::hosting {
namespace {

using tests::TestPeer;

constexpr std::uint64_t kParticipant = 7;  // of all inputs

// The others are recorded on request.
bool isAlwaysRecorded(const model::Scene& scene) {
  return scene.simulationRate > 30;
}

// A tick takes far longer than 0.1 s on a software device. Not recorded.
model::Scene heavyScene() {
  model::Scene scene = tests::smallScene("heavy");
  scene.simulationRate = scene.streamRate = 30;
  model::Cloth& cloth = scene.cloths.front();
  cloth.grid.rows = cloth.grid.columns = 64;
  cloth.pins.front().lastColumn = 63;
  cloth.solver.kind = model::SolverKind::constraint;
  cloth.solver.iterations = 400;
  cloth.solver.tolerance = 0;
  return scene;
}

// A scene and its viewer.
struct Resident {
  std::shared_ptr<scene::LiveScene> scene;
  std::unique_ptr<TestPeer> viewer;
};

class IndependenceTest : public tests::ServerTest {
 protected:
  // Starts a server with a quarter of these scenes, creates the others, and joins all of them.
  void start(std::size_t count) {
    ServerOptions options;
    options.maxCreatedScenes = 64;
    options.runAlways = true;
    options.encoderThreads = 3;                  // ticks of different scenes begin and end at the same time
    options.silence = std::chrono::minutes(30);  // viewers read rarely
    options.journals = [this](const model::Scene& scene) {
      return (isAlwaysRecorded(scene) ? always_ : onRequest_)->add(scene.name);
    };
    std::vector<model::Scene> own;
    while (own.size() < count / 4) own.push_back(tests::variedScene(own.size()));
    ServerTest::start(std::move(options), own);
    if (IsSkipped()) return;
    for (const model::Scene& scene : own) join(residents_.emplace_back(), server().scenes.find(scene.name));
    for (named_ = own.size(); named_ < count; ++named_)
      create(residents_.emplace_back(), tests::variedScene(named_));
    clock_ = std::make_unique<TestPeer>(server());
    clock_->join("small");
  }
  // Skips the test on devices that are too fast for exceedPrice().
  void startOnSlowDevice(std::size_t count) {
    start(count);
    if (!IsSkipped() && server().device.info().kind != vulkan::DeviceKind::software)
      GTEST_SKIP() << "a GPU is too fast for a scene to exceed its price";
  }
  // Something happens to the scenes, in random order, while "small" runs this number of ticks.
  void live(std::uint64_t ticks) {
    std::vector<int> deck(20);
    std::iota(deck.begin(), deck.end(), 0);
    std::size_t next = deck.size();
    const std::uint64_t end = metrics().ticks.value() + ticks;
    while (metrics().ticks.value() < end && !HasFatalFailure()) {
      if (next == deck.size()) {
        std::ranges::shuffle(deck, random_);
        next = 0;
      }
      act(deck[next++], residents_[below(residents_.size())]);
      clock_->readFrames(1);
    }
  }
  // A created scene takes far more than its price, and is stopped for good.
  void exceedPrice() {
    server().budget->setSpeed({.nodeStepSeconds = 1e-15, .dispatchSeconds = 1e-12, .workgroupFactor = 1});
    const auto heavy = server().created.create(heavyScene(), 8, "", {});
    ASSERT_TRUE(heavy) << heavy.error().text();
    TestPeer viewer(server());
    viewer.hello("heavy");
    EXPECT_THAT(viewer.readToTheEnd().error().text(), testing::HasSubstr("because it harms other scenes"));
    EXPECT_EQ(server().metrics.quarantines.value(), 1u);
  }
  // The device is lost, and all scenes are restored.
  void loseDevice() {
    const std::uint64_t before = server().metrics.deviceRebuilds.value();
    server().device.simulateDeviceLoss();
    for (const Resident& resident : residents_)
      resident.viewer->readUntil([](const v1::ServerMessage& message) {
        return message.notice().kind() == v1::NOTICE_KIND_DEVICE_REBUILT;
      });
    EXPECT_EQ(server().metrics.deviceRebuilds.value(), before + 1);
  }
  // Ends the server, and simulates every recording again.
  void expectTheSameAlone() {
    residents_.clear();
    clock_.reset();
    stop();
    always_.reset();
    onRequest_.reset();
    std::uint64_t files = 0, ticks = 0;
    for (const auto& file : std::filesystem::directory_iterator(directory_.path())) {
      const auto alone =
          recording::resimulate({.path = file.path().string(),
                                 .device = [](std::uint32_t) { return vulkan::DeviceOptions{}; },
                                 .interrupted = [] { return false; },
                                 .progress = {}});
      ASSERT_TRUE(alone) << alone.error();
      EXPECT_EQ(alone->different, 0u) << file.path() << ": " << toText(*alone);
      EXPECT_TRUE(alone->missing.empty()) << file.path() << ": " << toText(*alone);
      ++files;
      ticks += alone->ticks;
    }
    EXPECT_GE(files, recorded_);
    EXPECT_GT(ticks, 100u);
  }

  std::vector<Resident> residents_;
  std::unique_ptr<TestPeer> clock_;  // reads "small"

 private:
  // Does one of twenty things, some of which are the same.
  void act(int which, Resident& resident) {
    scene::LiveScene& scene = *resident.scene;
    switch (which) {
      case 0:
        return move(resident);
      case 1:
        return replace(resident);
      case 2:
      case 3:
        return hold(resident);
      case 4:
        return control(scene, scene.paused, true);
      case 5:
      case 6:
      case 7:
        return control(scene, !scene.paused, false);
      case 8:
      case 9:
        return startOrStopRecording(scene);
      case 10:
      case 11:
      case 12:
      case 13:
        return change(scene);
      default:
        return touch(scene);
    }
  }

  void join(Resident& resident, std::shared_ptr<scene::LiveScene> scene) {
    resident.scene = std::move(scene);
    resident.viewer = std::make_unique<TestPeer>(server());
    resident.viewer->join(resident.scene->name());
    if (isAlwaysRecorded(resident.scene->start())) ++recorded_;
  }
  void create(Resident& resident, model::Scene definition) {
    auto scene = server().created.create(std::move(definition), 8, "", {});
    ASSERT_TRUE(scene) << scene.error().text();
    join(resident, std::move(*scene));
  }
  void remove(Resident& resident) {
    server().created.remove(resident.scene,
                            delivery::notice(v1::NOTICE_KIND_SCENE_DELETED, "the scene is deleted", 0));
    resident.viewer.reset();
  }
  void replace(Resident& resident) {
    if (!resident.scene->terms.created) return;
    remove(resident);
    create(resident, tests::variedScene(named_++));
  }
  // Moves the scene to this server under another name, as if it came from another server.
  void move(Resident& resident) {
    if (!resident.scene->terms.created) return;
    scene::SavedScene saved{.start = resident.scene->start(),
                            .maxParticipants = 8,
                            .checkpoint = server().device.hold(resident.scene).get()};
    saved.start.name = fmt::format("scene-{}", named_++);
    if (saved.checkpoint) saved.checkpoint->scene.name = saved.start.name;
    auto arriving = server().created.prepareArrival(saved);
    ASSERT_TRUE(arriving) << arriving.error();
    arriving->start(saved);
    remove(resident);
    join(resident, server().scenes.find(saved.start.name));
  }
  void hold(Resident& resident) {
    server().device.hold(resident.scene).get();
    clock_->readFrames(below(3));
    server().device.unhold(resident.scene);
  }
  // Requests are refused if there are too many.
  void control(const scene::LiveScene& scene, bool paused, bool reset) {
    v1::ControlSceneRequest request;
    request.set_name(scene.name());
    request.set_paused(paused);
    request.set_reset(reset);
    static_cast<void>(server().requests.control(request, kParticipant));
  }
  static void startOrStopRecording(scene::LiveScene& scene) {
    if (scene.journal->active())
      static_cast<void>(scene.journal->stop());
    else
      static_cast<void>(scene.journal->start(""));
  }
  // Changes that do not fit the scene are refused.
  void change(scene::LiveScene& scene) {
    v1::ParameterChange change;
    switch (below(4)) {
      case 0:
        change.mutable_gravity()->mutable_value()->set_y(number(-12, -2));
        break;
      case 1:
        change.mutable_wind()->mutable_value()->set_z(number(-3, 3));
        break;
      case 2:
        change.add_cloths()->set_damping(number(0, 2));
        break;
      default: {
        const std::vector<model::Solver> solvers = tests::variedSolvers();
        *change.add_cloths()->mutable_solver() = messages::toMessage(solvers[below(solvers.size())]);
      }
    }
    static_cast<void>(scene.change(kParticipant, change, scene::Role::owner));
  }
  void touch(scene::LiveScene& scene) {
    const auto pose = [&] {
      return model::Pose{model::Vec3(number(-0.4f, 0.4f), number(-1, 0), number(-0.3f, 0.3f)),
                         model::Quaternion::Identity()};
    };
    model::ParticipantPoses poses;
    poses.colliders = {tests::handAt(1, number(-0.4f, 0.4f), number(-1, 0), number(-0.3f, 0.3f))};
    if (below(2) == 0) poses.grabs = {{.id = 1, .pose = pose(), .radius = 0.25f}};
    if (!scene.start().cloths.front().attachments.empty())
      poses.attachments = {{.attachment = 0, .pose = pose()}};
    scene.inbox.postPoses(kParticipant, std::move(poses), Clock::now());
  }

  std::size_t below(std::size_t end) {
    return std::uniform_int_distribution<std::size_t>(0, end - 1)(random_);
  }
  float number(float least, float most) {
    return std::uniform_real_distribution<float>(least, most)(random_);
  }

  e2e::TemporaryDirectory directory_;
  std::unique_ptr<recording::Recordings> always_ = recordings(true), onRequest_ = recordings(false);
  std::unique_ptr<recording::Recordings> recordings(bool always) const {
    return std::make_unique<recording::Recordings>(
        recording::RecorderOptions{.directory = directory_.path(), .serverName = "test"}, always);
  }
  std::size_t named_ = 0;     // number of the next scene
  std::size_t recorded_ = 0;  // scenes that were always recorded
  std::mt19937 random_{39};
};

TEST_F(IndependenceTest, ScenesInCompanyMoveAsAlone) {
  start(8);
  if (IsSkipped()) return;
  live(60);
  expectTheSameAlone();
}

TEST_F(IndependenceTest, FortyScenesInCompanyMoveAsAlone) {
  start(40);
  if (IsSkipped()) return;
  live(1000);
  expectTheSameAlone();
}

TEST_F(IndependenceTest, ScenesMoveAsAloneAfterFaults) {
  startOnSlowDevice(4);
  if (IsSkipped()) return;
  live(10);
  exceedPrice();
  live(10);
  loseDevice();
  live(30);
  expectTheSameAlone();
}

TEST_F(IndependenceTest, ScenesThatGoWrongHarmNoOther) {
  start(6);
  if (IsSkipped()) return;
  Resident &wild = residents_[0], &failing = residents_[5];
  for (int i = 0; i < 5; ++i)
    for (const float y : {-1e6f, -9.81f}) {
      ASSERT_TRUE(wild.scene->inbox.postChange({.participant = kParticipant, .change = tests::gravity(y)}));
      clock_->readFrames(3);
    }
  server().device.simulateFailuresIn(failing.scene->name(), 3);
  failing.viewer->readToTheEnd();
  clock_->readFrames(5);
  EXPECT_GT(wild.scene->metrics.rollbacks.value(), 0u);
  for (const Resident& resident : residents_) {
    if (&resident == &wild) continue;
    EXPECT_EQ(resident.scene->metrics.rollbacks.value(), 0u) << resident.scene->name();
  }
  EXPECT_EQ(server().metrics.deviceRebuilds.value(), 0u);
  expectTheSameAlone();
}

}  // namespace
}  // namespace clothstream::hosting
