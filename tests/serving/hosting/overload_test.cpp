// SPDX-License-Identifier: MIT
// A scene that overloads a real device: what it reduces, in which order, and that its recording repeats it.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/recording/resimulate.h"
#include "server/recording/scene_journal.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/serving/server_test.h"

namespace clothstream::hosting {
namespace {

using schedule::WorkLevel;
using testing::ElementsAre;
using testing::HasSubstr;
using tests::TestPeer;

// A tick takes at least several times its period on every software device: 1,600 iterations, which one
// workgroup makes one after another, in 4 ms.
model::Scene overloadingScene() {
  model::Scene scene = tests::smallScene("heavy");
  scene.simulationRate = scene.streamRate = 250;
  scene.substeps = 8;
  model::Cloth& cloth = scene.cloths[0];
  cloth.grid.rows = cloth.grid.columns = 64;
  cloth.pins[0].lastColumn = 63;
  cloth.mass = 1;
  cloth.solver.kind = model::SolverKind::constraint;
  cloth.solver.iterations = 200;
  cloth.solver.tolerance = 0;
  return scene;
}

class OverloadTest : public tests::ServerTest {
 protected:
  void start(bool adapts) {
    ServerOptions options;
    options.adaptsToLoad = adapts;
    options.journals = [this](const model::Scene& scene) -> std::shared_ptr<scene::Journal> {
      if (scene.name != "heavy") return nullptr;
      return std::make_shared<recording::SceneJournal>(
          scene.name, recording::RecorderOptions{.directory = directory_.path(), .serverName = "test"}, true);
    };
    ServerTest::start(std::move(options), {overloadingScene()});
    if (!IsSkipped() && server().device.info().kind != vulkan::DeviceKind::software)
      GTEST_SKIP() << "a GPU is too fast for this scene to overload it";
  }
  scene::LiveScene& heavy() { return *server().scenes.find("heavy"); }

  e2e::TemporaryDirectory directory_;
};

TEST_F(OverloadTest, ReducesFramesThenSubstepsAndItsRecordingSimulatesAgain) {
  start(true);
  if (IsSkipped()) return;
  TestPeer peer(server());
  peer.join("heavy");
  std::vector<WorkLevel> levels{heavy().allWork()};
  std::uint32_t sentDivisor = 0;
  peer.readUntil([&](const v1::ServerMessage& message) {
    if (message.has_frame()) sentDivisor = message.frame().frame_divisor();
    if (message.notice().kind() == v1::NOTICE_KIND_LOAD_CHANGED) levels.push_back(heavy().work);
    return levels.back() == WorkLevel{4, 2};
  });
  // A level may be over before its notice is read.
  EXPECT_TRUE(std::ranges::is_sorted(levels, {}, &WorkLevel::frameDivisor));
  EXPECT_TRUE(std::ranges::is_sorted(levels, std::ranges::greater{}, &WorkLevel::substeps));
  for (const WorkLevel& level : levels) EXPECT_TRUE(level.substeps == 8 || level.frameDivisor == 4);
  EXPECT_EQ(heavy().metrics.overloadStepsDown.value(), 5u);
  peer.readUntil([&](const v1::ServerMessage& message) {
    if (message.has_frame()) sentDivisor = message.frame().frame_divisor();
    return sentDivisor == 4;
  });
  TestPeer light(server());
  light.join("small");
  // The light scene keeps at least a quarter of its rate, counted in its ticks, on a machine with other work.
  const telemetry::SceneMetrics& lightMetrics = metrics();
  const std::uint64_t slippedBefore = lightMetrics.slippedTicks.value(),
                      ticksBefore = lightMetrics.ticks.value();
  light.readFrames(20);
  const std::uint64_t ticks = lightMetrics.ticks.value() - ticksBefore;
  EXPECT_LE(lightMetrics.slippedTicks.value() - slippedBefore, 3 * ticks);
  EXPECT_EQ(server().scenes.find("small")->work.load(), server().scenes.find("small")->allWork());

  // A peer that joins later learns it.
  TestPeer later(server());
  later.hello("heavy");
  const v1::ServerMessage notice = later.readUntil([](const v1::ServerMessage& message) {
    return message.notice().kind() == v1::NOTICE_KIND_LOAD_CHANGED;
  });
  EXPECT_EQ(notice.notice().text(),
            "the device is overloaded: the scene sends 62 of 250 frames/s and computes 2 of 8 substeps");

  later.leave();
  peer.leave();
  light.leave();
  stop();
  const std::filesystem::path file = std::filesystem::directory_iterator(directory_.path())->path();
  const auto again = recording::resimulate({.path = file.string(),
                                            .device = [](std::uint32_t) { return vulkan::DeviceOptions{}; },
                                            .interrupted = [] { return false; },
                                            .progress = {}});
  ASSERT_TRUE(again) << again.error();
  EXPECT_GT(again->ticks, 5u);
  EXPECT_EQ(again->different, 0u) << toText(*again);
  EXPECT_TRUE(again->missing.empty());
}

TEST_F(OverloadTest, KeepsAllWorkIfTheOperatorSaysSo) {
  start(false);
  if (IsSkipped()) return;
  TestPeer peer(server());
  peer.join("heavy");
  // Time has slipped for two intervals then.
  const v1::ServerMessage notice = peer.readUntil([](const v1::ServerMessage& message) {
    return message.notice().kind() == v1::NOTICE_KIND_RUNNING_SLOW ||
           message.notice().kind() == v1::NOTICE_KIND_LOAD_CHANGED;
  });
  EXPECT_EQ(notice.notice().kind(), v1::NOTICE_KIND_RUNNING_SLOW);
  EXPECT_THAT(notice.notice().text(), HasSubstr("cannot keep 250 ticks/s with 8 substeps"));
  EXPECT_EQ(heavy().work.load(), heavy().allWork());
  peer.leave();
}

}  // namespace
}  // namespace clothstream::hosting
