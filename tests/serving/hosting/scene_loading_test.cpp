// SPDX-License-Identifier: MIT
// A scene that takes long to load, while another one runs.
#include <algorithm>
#include <future>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "server/schedule/clock.h"
#include "tests/serving/hosting/scenes_test.h"

namespace clothstream::hosting {
namespace {

using schedule::Clock;
using schedule::seconds;
using tests::TestPeer;

// A scene with tables of 590,000 constraints. Loading it takes many times longer than a tick of the others.
model::Scene heavyScene() {
  model::Scene heavy = tests::smallScene("heavy");
  model::Cloth& cloth = heavy.cloths[0];
  cloth.grid.rows = cloth.grid.columns = 256;
  cloth.pins[0].lastColumn = 255;
  cloth.solver.kind = model::SolverKind::constraint;
  heavy.substeps = 1;
  return heavy;
}

// A scene with many ticks per second, so that several of them fall into the loading, also on a fast machine.
model::Scene lightScene() {
  model::Scene light = tests::smallScene("light");
  light.simulationRate = light.streamRate = 200;
  light.substeps = 3;
  return light;
}

// The light scene runs while a peer joins the heavy one.
class HeavySceneTest : public tests::ServerTest {
 protected:
  void SetUp() override {
    START({}, {heavyScene(), lightScene()});
    light = std::make_unique<TestPeer>(server());
    heavy = std::make_unique<TestPeer>(server());
    light->join("light");
    heavy->hello("heavy");
  }
  bool heavyRuns() { return server().scenes.find("heavy")->running; }

  std::unique_ptr<TestPeer> light, heavy;
};

TEST_F(HeavySceneTest, OtherScenesContinueWhileItLoads) {
  const Clock::time_point asked = Clock::now();
  Clock::time_point last = asked;
  Clock::duration longest{};
  int frames = 0;
  for (; !heavyRuns(); ++frames) {
    light->readFrames(1);
    const Clock::time_point now = Clock::now();
    longest = std::max(longest, now - std::exchange(last, now));
  }
  fmt::print("made ready in {:.0f} ms; another scene's {} frames meanwhile at most {:.0f} ms apart\n",
             1e3 * seconds(last - asked), frames, 1e3 * seconds(longest));
  // Two frames and one tick may be in flight at the beginning.
  EXPECT_GE(frames, 8);
  heavy->readFrames(1);
}

TEST_F(HeavySceneTest, IsLoadedAgainAfterADeviceLoss) {
  light->readFrames(2);
  server().device.simulateDeviceLoss();
  light->readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_DEVICE_REBUILT; });
  heavy->readFrames(1);
  light->readFrames(3);
}

TEST_F(HeavySceneTest, ServerStopsWhileItLoads) {
  light->readFrames(2);
  v1::CreateSceneRequest request;
  request.set_named("heavy");
  request.set_name("heavier");
  std::promise<void> answered;
  server().unaryCalls.createScene(request, [&](const auto&) { answered.set_value(); });
  light->vanish();
  heavy->vanish();
  stop();
  answered.get_future().get();
}

}  // namespace
}  // namespace clothstream::hosting
