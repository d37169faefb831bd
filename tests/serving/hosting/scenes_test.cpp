// SPDX-License-Identifier: MIT
// Scenes that peers create, delete, pause and reset.
#include "tests/serving/hosting/scenes_test.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/scene/checkpoint.h"
#include "server/scene/live_scene.h"

namespace clothstream::hosting {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using tests::TestPeer;

v1::ServerMessage control(TestPeer& peer, const std::string& name, std::optional<bool> paused, bool reset) {
  v1::ClientMessage message;
  message.mutable_control_scene()->set_name(name);
  if (paused) message.mutable_control_scene()->set_paused(*paused);
  message.mutable_control_scene()->set_reset(reset);
  return ask(peer, message);
}

TEST_F(ScenesTest, CreatedSceneLivesUntilDeleted) {
  START();
  TestPeer maker(server());
  ASSERT_TRUE(createNamed(maker, "small", "mine").has_create_scene());
  EXPECT_EQ(server().unaryCalls.listScenes().scenes_size(), 3);
  EXPECT_THAT(createNamed(maker, "small", "mine").error().text(), HasSubstr("already"));
  EXPECT_EQ(createNamed(maker, "nowhere", "x").error().code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(createNamed(maker, "small", "No Name").error().text(), StartsWith("createScene.name = "));
  EXPECT_THAT(createNamed(maker, "../../etc/passwd", "x").error().text(), HasSubstr("there is no scene"));

  TestPeer inside(server()), outside(server());
  inside.join("mine");
  outside.join("small");
  ASSERT_TRUE(deleteScene(maker, "mine").has_delete_scene());
  const v1::ServerMessage last = inside.readToTheEnd();
  EXPECT_EQ(last.notice().kind(), v1::NOTICE_KIND_SCENE_DELETED);
  EXPECT_EQ(server().unaryCalls.listScenes().scenes_size(), 2);
  outside.readFrames(3);
  EXPECT_EQ(deleteScene(maker, "mine").error().code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(deleteScene(maker, "small").error().text(), HasSubstr("must be of a scene that was created"));
  // The name is free again.
  EXPECT_TRUE(createNamed(maker, "small", "mine").has_create_scene());
  TestPeer again(server());
  again.join("mine");
}

TEST_F(ScenesTest, DeletesUnusedCreatedScene) {
  ServerOptions options;
  options.sceneLifetime = std::chrono::milliseconds(300);
  options.reconnectGrace.place = std::chrono::seconds(0);
  START(options);
  TestPeer maker(server());
  ASSERT_TRUE(createNamed(maker, "small", "used").has_create_scene());
  TestPeer user(server());
  user.join("used");
  ASSERT_TRUE(createNamed(maker, "small", "unused").has_create_scene());
  const auto scenes = [&] { return server().unaryCalls.listScenes().scenes_size(); };
  while (scenes() > 3) user.readFrames(1);
  user.readFrames(40);  // a second of the scene
  EXPECT_EQ(scenes(), 3);
  user.leave();
  const auto end = std::chrono::steady_clock::now() + TestPeer::kPatience;
  while (scenes() > 2 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(scenes(), 2);
}

TEST_F(ScenesTest, LimitsCreatedScenes) {
  ServerOptions options;
  options.maxCreatedScenes = 1;
  START(options);
  TestPeer maker(server());
  ASSERT_TRUE(createNamed(maker, "small", "one").has_create_scene());
  EXPECT_EQ(createNamed(maker, "small", "two").error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  ASSERT_TRUE(deleteScene(maker, "one").has_delete_scene());
  EXPECT_TRUE(createNamed(maker, "small", "two").has_create_scene());
}

// A scene that is being made or arrives from another server has its name and its place already.
TEST_F(ScenesTest, ASceneThatIsBeingMadeHasItsNameAndItsPlace) {
  ServerOptions options;
  options.maxCreatedScenes = 2;
  START(options);
  SceneRegistry& scenes = server().scenes;
  TestPeer peer(server());
  auto arrives = std::make_optional(scenes.takePlace("arrives", "", false));
  ASSERT_TRUE(*arrives);
  EXPECT_THAT(scenes.takePlace("arrives", "", true).error().text(), HasSubstr("'arrives' exists already"));
  EXPECT_THAT(createNamed(peer, "small", "arrives").error().text(), HasSubstr("'arrives' exists already"));
  EXPECT_TRUE(createNamed(peer, "small", "first").has_create_scene());
  EXPECT_THAT(createNamed(peer, "small", "second").error().text(),
              HasSubstr("the server has 2 created scenes"));
  arrives.reset();
  EXPECT_TRUE(createNamed(peer, "small", "arrives").has_create_scene());
}

TEST_F(ScenesTest, AbandonedArrivalFreesItsPlace) {
  ServerOptions options;
  options.maxCreatedScenes = 1;
  START(options);
  const scene::SavedScene saved{.start = tests::smallScene("arrives"), .maxParticipants = 8};
  {
    auto arriving = server().created.prepareArrival(saved);
    ASSERT_TRUE(arriving) << arriving.error();
    EXPECT_FALSE(server().scenes.find("arrives")) << "no peer can join it yet";
    EXPECT_FALSE(server().scenes.takePlace("arrives", "", true));
  }
  EXPECT_EQ(server().budget->usage().load, 0);
  EXPECT_TRUE(server().scenes.takePlace("arrives", "", true));
}

TEST_F(ScenesTest, ArrivalThatCannotStartFreesItsPlace) {
  START();
  scene::SavedScene saved{.start = tests::smallScene("arrives"), .maxParticipants = 8};
  {
    auto arriving = server().created.prepareArrival(saved);
    ASSERT_TRUE(arriving) << arriving.error();
    scene::Checkpoint& checkpoint = saved.checkpoint.emplace();  // its state has no nodes
    checkpoint.scene = saved.start;
    checkpoint.colliders = scene::ColliderSet(saved.start).state();
    EXPECT_ANY_THROW(arriving->start(saved));
    EXPECT_FALSE(server().scenes.find("arrives"));
  }
  EXPECT_EQ(server().budget->usage().load, 0);
  EXPECT_TRUE(server().scenes.takePlace("arrives", "", true));
}

TEST_F(ScenesTest, StartedArrivalStays) {
  START();
  const scene::SavedScene saved{.start = tests::smallScene("arrives"), .maxParticipants = 8};
  {
    auto arriving = server().created.prepareArrival(saved);
    ASSERT_TRUE(arriving) << arriving.error();
    arriving->start(saved);
    arriving->abandon();
  }
  TestPeer peer(server());
  peer.join("arrives");
  EXPECT_FALSE(server().scenes.takePlace("arrives", "", true));
}

TEST_F(ScenesTest, SceneHasItsOwnParticipantLimit) {
  ServerOptions options;
  options.maxParticipants = 5;
  START(options);
  TestPeer maker(server());
  v1::ClientMessage message;
  v1::CreateSceneRequest& create = *message.mutable_create_scene();
  create.set_named("small");
  create.set_name("duet");
  create.set_max_participants(6);
  EXPECT_THAT(ask(maker, message).error().text(),
              StartsWith("createScene.maxParticipants = 6: must be at most 5"));
  create.set_max_participants(2);
  EXPECT_EQ(ask(maker, message).create_scene().scene().max_participants(), 2u);
  EXPECT_EQ(createNamed(maker, "small", "usual").create_scene().scene().max_participants(), 5u);

  TestPeer first(server()), second(server()), third(server());
  first.join("duet");
  second.join("duet");
  third.hello("duet");
  EXPECT_THAT(third.readToTheEnd().error().text(), HasSubstr("'duet' has 2 participants"));
}

TEST_F(ScenesTest, BuiltInScenesShareTheDeviceAsGuests) {
  ServerOptions options;
  options.guestScenes = {"small", "other"};
  START(std::move(options), {tests::smallScene("own")});
  TestPeer peer(server());
  ASSERT_TRUE(createNamed(peer, "small", "mine").has_create_scene());
  EXPECT_FALSE(server().scenes.find("small")->isGuest()) << "it is the default scene";
  EXPECT_TRUE(server().scenes.find("other")->isGuest());
  EXPECT_FALSE(server().scenes.find("own")->isGuest());
  EXPECT_TRUE(server().scenes.find("mine")->isGuest());
}

TEST_F(ScenesTest, LimitsPausesAndResetsOfOneParticipant) {
  START();
  v1::ControlSceneRequest request;
  request.set_paused(false);
  std::string text;
  for (int i = 0; i <= 10 * scene::ChangeLimits::kOfParticipantPerSecond && text.empty(); ++i)
    if (const auto controlled = server().requests.control(request, 1); !controlled)
      text = controlled.error().text();
  EXPECT_EQ(
      text,
      "controlScene: too many changes of 'small' by one participant in one second; send it again later");
  EXPECT_TRUE(server().requests.control(request, 2)) << "another participant may";
}

TEST_F(ScenesTest, PausedSceneStandsStillAndContinues) {
  START();
  TestPeer peer(server()), other(server());
  peer.join();
  other.join("other");
  ASSERT_TRUE(control(other, "small", true, false).control_scene().scene().paused());
  peer.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED; });
  // Frames in flight at the start of the pause arrive within a few ticks of another scene.
  other.readFrames(4);
  const std::uint64_t ticks = metrics().ticks.value();
  other.readFrames(10);
  EXPECT_EQ(metrics().ticks.value(), ticks);
  EXPECT_FALSE(server().unaryCalls.listScenes().scenes(0).running());
  // Also announced to a peer that joins now.
  TestPeer late(server());
  late.hello();
  late.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED; });
  // The shape of the cloth is kept as well.
  late.readFrames(1);
  EXPECT_EQ(late.frames().back().tick, ticks);
  EXPECT_EQ(metrics().ticks.value(), ticks);

  ASSERT_FALSE(control(other, "small", false, false).control_scene().scene().paused());
  peer.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_RESUMED; });
  peer.readFrames(5);
  EXPECT_LT(peer.frames().back().tick, ticks + 20);
  late.readFrames(5);
  EXPECT_LT(late.frames().back().tick, ticks + 20);
  EXPECT_EQ(control(other, "nowhere", true, false).error().code(), v1::ERROR_CODE_NOT_FOUND);
}

TEST_F(ScenesTest, ResetSceneRestartsWithItsPresentParameters) {
  START();
  TestPeer peer(server());
  peer.join();
  v1::ParameterChange change;
  change.mutable_gravity()->mutable_value();  // zero gravity
  peer.change(change);
  peer.readFrames(20);
  const auto lowest = [&] {
    float y = 1e9f;
    for (std::size_t i = 1; i < peer.decoder().positions().size(); i += 3)
      y = std::min(y, peer.decoder().positions()[i]);
    return y;
  };
  ASSERT_TRUE(control(peer, "", std::nullopt, true).has_control_scene());
  peer.readUntil([](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_RESET; });
  peer.readFrames(3);
  // The cloth is at rest without gravity, except where the ball pushes it.
  EXPECT_NEAR(lowest(), -1.1f, 0.02f);
  EXPECT_EQ(peer.description().definition().name(), "small");
  EXPECT_EQ(server().unaryCalls.getScene({}).value().scene().environment().gravity().y(), 0);
}

TEST_F(ScenesTest, ResetOfAPausedSceneIsShown) {
  model::Scene sparse = tests::smallScene("sparse");  // streams every third tick
  sparse.simulationRate = 60;
  sparse.streamRate = 20;
  sparse.colliders.clear();
  sparse.environment.wind = model::Vec3(0, 0, 5);
  ServerOptions options;
  options.adaptsToLoad = false;  // a busy machine would halve the stream rate
  START(options, {sparse});
  TestPeer peer(server()), other(server());
  peer.join("sparse");
  const auto farthest = [&] {  // largest distance from the plane of the start
    float z = 0;
    for (std::size_t i = 2; i < peer.decoder().positions().size(); i += 3)
      z = std::max(z, std::abs(peer.decoder().positions()[i]));
    return z;
  };
  other.join("other");
  peer.readFrames(20);
  control(other, "sparse", true, false);
  peer.readUntil(
      [](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED; });
  // Frames in flight at the start of the pause arrive within a few ticks of another scene.
  other.readFrames(4);
  const telemetry::SceneMetrics& metrics = server().scenes.find("sparse")->metrics;
  const std::uint64_t ticks = metrics.ticks.value();
  const float before = farthest();

  control(other, "sparse", std::nullopt, true);
  peer.readUntil([](const v1::ServerMessage& m) { return m.notice().kind() == v1::NOTICE_KIND_SCENE_RESET; });
  while (peer.frames().back().tick <= ticks) peer.readFrames(1);
  const std::uint64_t shown = peer.frames().back().tick;
  EXPECT_EQ(shown % 3, 0u);
  EXPECT_LE(shown, ticks + 3);
  // The wind has acted for at most three ticks, compared with a second before the pause.
  EXPECT_LT(farthest(), before / 10);
  other.readFrames(4);
  EXPECT_EQ(metrics.ticks.value(), shown);
  EXPECT_FALSE(server().scenes.find("sparse")->running);
}

}  // namespace
}  // namespace clothstream::hosting
