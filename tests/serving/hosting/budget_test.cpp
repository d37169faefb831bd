// SPDX-License-Identifier: MIT
// Budgets of device time and memory, and quarantine of scenes that exceed their price.
#include "server/scene/budget.h"

#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/encode/worker_threads.h"
#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "server/scene/scene_on_device.h"
#include "tests/serving/server_test.h"

// Starts the server, and ends the test if there is no device.
#define START(...)    \
  start(__VA_ARGS__); \
  if (IsSkipped()) return

namespace clothstream::scene {
namespace {

using ::testing::HasSubstr;
using ::testing::MatchesRegex;
using ::testing::StartsWith;
using tests::TestPeer;

// 1 microsecond a node-step and nothing for a dispatch.
constexpr model::DeviceSpeed kSpeed{.nodeStepSeconds = 1e-6, .dispatchSeconds = 0, .workgroupFactor = 1};

double loadOf(const model::Scene& scene) {
  return model::PriceModel(scene).work(scene).seconds(kSpeed) * scene.simulationRate;
}

model::Scene constrained(std::uint32_t iterations) {
  model::Scene scene = tests::smallScene();
  scene.cloths[0].solver.kind = model::SolverKind::constraint;
  scene.cloths[0].solver.iterations = iterations;
  return scene;
}

// Ticks have no limit by default.
std::shared_ptr<Budget> budgetOf(BudgetLimits limits, double tickSeconds = 0) {
  limits.tickSeconds = tickSeconds;
  auto budget = std::make_shared<Budget>(limits);
  budget->setSpeed(kSpeed);
  return budget;
}

TEST(BudgetTest, RefusesSceneAboveItsLimitAndNamesIterationsThatFit) {
  const model::Scene large = constrained(1000), small = constrained(17);
  const auto budget = budgetOf({.sceneLoad = loadOf(small) * 1.001, .load = 100});
  Charge charge(budget, large, false);
  const auto refused = charge.charge("createScene.scene", large);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error().text, HasSubstr("createScene.scene: would take "));
  EXPECT_THAT(refused.error().text, HasSubstr("(--max-load, --profile)"));
  EXPECT_THAT(refused.error().text, HasSubstr("at most 17 iterations would fit"));
  // The number of iterations that the error names fits.
  EXPECT_TRUE(charge.charge("createScene.scene", small));
}

TEST(BudgetTest, NamesSubstepsOrNodesIfFewerIterationsDoNotHelp) {
  model::Scene scene = tests::smallScene();
  model::Scene fewer = scene;
  fewer.substeps = 5;
  Charge charge(budgetOf({.sceneLoad = loadOf(fewer) * 1.001, .load = 100}), scene, false);
  EXPECT_THAT(charge.charge("x", scene).error().text, HasSubstr("at most 5 substeps would fit"));
  Charge tiny(budgetOf({.sceneLoad = loadOf(scene) / 100, .load = 100}), scene, false);
  EXPECT_THAT(tiny.charge("x", scene).error().text, HasSubstr("about 1 nodes would fit"));
}

// At a low rate, a scene within its load may still have a tick that delays other scenes for seconds.
TEST(BudgetTest, RefusesSceneWithALongTickAndNamesIterationsThatFit) {
  model::Scene large = constrained(1000), small = constrained(17);
  large.simulationRate = large.streamRate = small.simulationRate = small.streamRate = 1;
  const double tickSeconds = loadOf(small) * 1.001;
  const auto budget = budgetOf({.sceneLoad = loadOf(large) * 2, .load = 1e9}, tickSeconds);
  Charge charge(budget, large, false);
  const auto refused = charge.charge("createScene.scene", large);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_EQ(refused.error().limit, telemetry::Refusal::budget);
  EXPECT_THAT(refused.error().text, HasSubstr("s of the device's time a tick"));
  EXPECT_THAT(refused.error().text, HasSubstr("(--max-tick-time): at most 17 iterations would fit"));
  EXPECT_TRUE(charge.charge("createScene.scene", small));
  EXPECT_LT(charge.roomForOthers(small, 0), 50) << "50 colliders do not fit";
  Charge unlimited(budgetOf({.sceneLoad = loadOf(large) * 2, .load = 1e9}), large, false);
  EXPECT_TRUE(unlimited.charge("createScene.scene", large));
}

// Only an owner may slow a scene down.
TEST(BudgetTest, AParticipantKeepsASceneInTime) {
  using enum Charge::Pace;
  const auto sceneOf = [](std::uint32_t iterations) {
    model::Scene scene = constrained(iterations);
    scene.simulationRate = scene.streamRate = 20;
    return scene;
  };
  const model::Scene start = sceneOf(1), slow = sceneOf(1000);
  const auto budget = budgetOf({.sceneLoad = 1e9, .load = 1e9});
  ASSERT_LT(loadOf(sceneOf(2)), 0.5);
  ASSERT_GT(loadOf(slow), 1.5);
  Charge charge(budget, start, true);
  const auto refused = charge.charge("parameterChange", slow, inTime);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error().text,
              MatchesRegex("parameterChange: would take .* only an owner of the scene may "
                           "let it take more than 0.70 s, .* [0-9]* iterations would fit"));
  EXPECT_TRUE(charge.charge("parameterChange", sceneOf(2), inTime));
  ASSERT_TRUE(charge.charge("parameterChange", slow, any)) << "by an owner";
  EXPECT_TRUE(charge.charge("parameterChange", sceneOf(999), inTime)) << "cheaper than now";
  // A scene that is slow by itself can still be changed a little.
  Charge slowly(budget, slow, true);
  model::Scene windy = slow;
  windy.environment.airDensity = 1;
  windy.cloths[0].drag = 1;
  EXPECT_TRUE(slowly.charge("parameterChange", windy, inTime));
  EXPECT_FALSE(slowly.charge("parameterChange", sceneOf(1500), inTime));
}

TEST(BudgetTest, ScenesShareOneBudgetAndGiveItBack) {
  const model::Scene scene = tests::smallScene();
  const auto budget = budgetOf({.sceneLoad = 100, .load = loadOf(scene) * 1.5});
  {
    Charge first(budget, scene, false), second(budget, scene, false);
    EXPECT_TRUE(first.charge("first", scene));
    const auto refused = second.charge("second", scene);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().text, HasSubstr("(--max-load, --profile)"));
  }
  Charge third(budget, scene, false);
  EXPECT_TRUE(third.charge("third", scene));
}

TEST(BudgetTest, AReleasedSceneCostsNothingWhenItsParticipantsLeave) {
  const model::Scene scene = tests::smallScene();
  model::Scene fewer = scene;
  fewer.substeps = 5;
  const auto budget = budgetOf({.sceneLoad = 100, .load = loadOf(fewer) * 1.001});
  Charge large(budget, scene, false), small(budget, fewer, false);
  EXPECT_THAT(large.charge("", scene).error().text, StartsWith("would take "));
  large.release();
  large.chargeColliders(scene, {});
  EXPECT_TRUE(small.charge("small", fewer));
}

TEST(BudgetTest, LimitsMemoryOfASceneAndOfAll) {
  const model::Scene scene = tests::smallScene();
  const double megabytes = model::PriceModel(scene).bytes(scene) / 1e6;
  Charge single(budgetOf({.sceneMegabytes = megabytes * 0.9}), scene, false);
  const auto refused = single.charge("x", scene);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, HasSubstr("MB of memory"));
  EXPECT_THAT(refused.error().text, HasSubstr("(--max-memory, --profile)"));
  const auto budget = budgetOf({.sceneLoad = 100, .load = 100, .megabytes = megabytes * 1.5});
  Charge first(budget, scene, false), second(budget, scene, false);
  EXPECT_TRUE(first.charge("first", scene));
  EXPECT_FALSE(second.charge("second", scene));
}

TEST(BudgetTest, SceneOfTheServerIsFreeAndItsChangesAreNot) {
  const model::Scene start = constrained(100);
  const auto budget = budgetOf({.sceneLoad = loadOf(constrained(200)) - loadOf(start), .load = 100});
  Charge charge(budget, start, true);
  EXPECT_TRUE(charge.charge("x", start));
  EXPECT_TRUE(charge.charge("x", constrained(199)));
  const auto refused = charge.charge("x", constrained(300));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text, ::testing::ContainsRegex("at most (199|200) iterations would fit"));
  // Less is always allowed, and so is going back.
  EXPECT_TRUE(charge.charge("x", constrained(150)));
  charge.restore(start);
  EXPECT_TRUE(charge.charge("x", constrained(199)));
}

class BudgetOfServerTest : public tests::ServerTest {};

v1::ServerMessage ask(TestPeer& peer, v1::ClientMessage message) {
  message.set_request_id(7);
  peer.send(message);
  return peer.readUntil([](const v1::ServerMessage& answer) { return answer.request_id() == 7; });
}

v1::ServerMessage createCopy(TestPeer& peer, const std::string& name) {
  v1::ClientMessage message;
  message.mutable_create_scene()->set_named("small");
  message.mutable_create_scene()->set_name(name);
  return ask(peer, message);
}

TEST_F(BudgetOfServerTest, RefusesSceneBeyondTheMemoryUntilAnotherIsDeleted) {
  const double megabytes = model::PriceModel(tests::smallScene()).bytes(tests::smallScene()) / 1e6;
  START({}, {}, {.sceneLoad = 1e9, .load = 1e9, .megabytes = 1.5 * megabytes});
  TestPeer peer(server());
  ASSERT_TRUE(createCopy(peer, "one").has_create_scene());
  const v1::ServerMessage refused = createCopy(peer, "two");
  EXPECT_EQ(refused.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_FALSE(refused.error().fatal());
  EXPECT_THAT(refused.error().text(), HasSubstr("createScene.scene: would take "));
  EXPECT_EQ(server().unaryCalls.listScenes().scenes_size(), 3);
  v1::ClientMessage remove;
  remove.mutable_delete_scene()->set_name("one");
  ASSERT_TRUE(ask(peer, remove).has_delete_scene());
  EXPECT_TRUE(createCopy(peer, "two").has_create_scene());
}

TEST_F(BudgetOfServerTest, RefusesChangeBeyondTheLoadAndTheSceneContinues) {
  model::Scene scene = constrained(5);
  scene.name = "iterates";
  START({}, {scene}, {.sceneLoad = 0, .load = 0});
  TestPeer peer(server());
  peer.join("iterates");
  v1::ClientMessage change;
  v1::ClothChange& cloth = *change.mutable_parameter_change()->add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_solver()->mutable_constraint()->set_iterations(1000);
  const v1::ServerMessage refused = ask(peer, change);
  EXPECT_EQ(refused.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(refused.error().text(), HasSubstr("parameterChange: would take "));
  peer.readFrames(3);
  // A change that costs nothing is accepted.
  v1::ClientMessage cheaper;
  cheaper.mutable_parameter_change()->mutable_gravity()->mutable_value()->set_y(-5);
  peer.send(cheaper);
  peer.readUntil(v1::ServerMessage::kParameterChanged);
}

// A scene that takes far more than its price is stopped. Here the price is far too low.
TEST_F(BudgetOfServerTest, SceneThatTakesFarMoreThanItsPriceIsStopped) {
  model::Scene heavy = constrained(400);
  heavy.name = "heavy";
  heavy.cloths[0].grid.rows = heavy.cloths[0].grid.columns = 64;
  heavy.cloths[0].pins[0].lastColumn = 63;
  heavy.cloths[0].solver.tolerance = 0;
  START({}, {heavy});
  if (server().device.info().kind != vulkan::DeviceKind::software)
    GTEST_SKIP() << "a GPU is too fast for this scene to harm others";
  server().budget->setSpeed({.nodeStepSeconds = 1e-15, .dispatchSeconds = 1e-12, .workgroupFactor = 1});
  TestPeer honest(server());
  honest.join("small");
  TestPeer peer(server());
  peer.hello("heavy");
  // A scene of the server starts again first, with its own parameters.
  EXPECT_THAT(peer.readToTheEnd().error().text(),
              HasSubstr("join again to start it with its own parameters"));
  EXPECT_EQ(server().metrics.quarantines.value(), 0u);
  honest.readFrames(1);  // a client that is silent for 30 s is disconnected
  TestPeer again(server());
  again.hello("heavy");
  const v1::ServerMessage last = again.readToTheEnd();
  EXPECT_EQ(last.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_TRUE(last.error().fatal());
  EXPECT_THAT(last.error().text(), HasSubstr("it harms other scenes: "));
  EXPECT_THAT(last.error().text(), HasSubstr("; join again in 10 s"));
  EXPECT_EQ(server().metrics.quarantines.value(), 1u);
  honest.readFrames(3);
  TestPeer later(server());
  later.hello("heavy");
  EXPECT_THAT(later.readToTheEnd().error().text(),
              ::testing::MatchesRegex("the scene 'heavy' is stopped because it harms other scenes: .*; join "
                                      "again in [0-9]+ s"));
  const std::shared_ptr<LiveScene> live = server().scenes.find("heavy");
  EXPECT_EQ(live->quarantined(Clock::now() + std::chrono::seconds(10)), "") << "it comes back";
}

// Memory of every scene that the server knows, as it is allocated, is within its price.
TEST_F(BudgetOfServerTest, PriceCoversTheDeviceMemoryOfEveryNamedScene) {
  START();
  vulkan::Device& device = tests::device();
  encode::WorkerThreads workers(0);
  for (const std::string& name : messages::namedScenes()) {
    const messages::Result<model::Scene> scene = messages::loadScene(name);
    ASSERT_TRUE(scene) << scene.error().text;
    const std::uint64_t before = device.allocatedBytes();
    const SceneOnDevice loaded(device, *scene, workers);
    const auto bytes = static_cast<double>(device.allocatedBytes() - before);
    EXPECT_GT(bytes, 0) << name;
    EXPECT_LT(bytes, model::PriceModel(*scene).bytes(*scene)) << name;
  }
}

}  // namespace
}  // namespace clothstream::scene
