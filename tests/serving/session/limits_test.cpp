// SPDX-License-Identifier: MIT
// Deadlines, uploads and the work that one peer may cause.
#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/scene_message.h"
#include "server/scene/collider_shares.h"
#include "tests/model/meshes.h"
#include "tests/serving/server_test.h"

// Starts the server, and ends the test if there is no device.
#define START(...)    \
  start(__VA_ARGS__); \
  if (IsSkipped()) return

namespace clothstream::session {
namespace {

using namespace std::chrono_literals;
using hosting::ServerOptions;
using hosting::UploadBudget;
using schedule::Clock;
using telemetry::Refusal;
using ::testing::HasSubstr;
using tests::TestPeer;
using Body = v1::ServerMessage;

class PeerLimitsTest : public tests::ServerTest {
 protected:
  // As the server does once a second.
  void checkAt(Clock::time_point time) {
    for (const auto& peer : server().connections.peers()) peer->checkSilence(time);
  }
  void checkAfter(Clock::duration time) { checkAt(Clock::now() + time); }
  std::uint64_t refused(Refusal reason) {
    return server().metrics.refusals[static_cast<std::size_t>(reason)].value();
  }
};

v1::ClientMessage ping() {
  v1::ClientMessage message;
  message.mutable_ping()->set_client_time_us(1);
  return message;
}

// Frames of all scenes wait for this check.
TEST_F(PeerLimitsTest, CheckOfSilenceDoesNotWaitForABusySession) {
  START();
  std::promise<void> entered, release;
  std::atomic<bool> isFirst{true};
  const auto session = Session::open(server(), {.peer = "busy", .address = {}, .token = {}}, [&] {
    if (!isFirst.exchange(false)) return;
    entered.set_value();
    release.get_future().wait();
  });
  const std::string bytes = ping().SerializeAsString();
  std::thread handler([&] { session->receive(std::as_bytes(std::span(bytes))); });
  entered.get_future().wait();
  auto check = std::async(std::launch::async, [&] { checkAfter(0s); });
  EXPECT_EQ(check.wait_for(60s), std::future_status::ready);
  release.set_value();
  handler.join();
  check.get();
}

// Chunk 0 of an upload of this many bytes in all.
v1::ClientMessage firstChunk(std::size_t bytes, std::size_t total) {
  v1::ClientMessage message;
  v1::Chunk& chunk = *message.mutable_upload();
  chunk.set_content_id(9);
  chunk.set_kind(v1::CONTENT_KIND_SCENE);
  chunk.set_count(bytes == total ? 1 : 2);
  chunk.set_total_bytes(total);
  chunk.set_data(std::string(bytes, '\xff'));
  return message;
}

TEST_F(PeerLimitsTest, HelloTimeoutCountsFromTheStartHoweverMuchThePeerPings) {
  START();
  TestPeer member(server());
  member.join();
  const Clock::time_point before = Clock::now();
  TestPeer pings(server()), asks(server());
  pings.send(ping());
  v1::ClientMessage question;
  question.mutable_list_scenes();
  asks.send(question);
  checkAt(before + 10s);
  EXPECT_FALSE(pings.finished());
  pings.send(ping());
  asks.send(question);
  checkAfter(11s);
  for (TestPeer* peer : {&pings, &asks}) {
    const v1::Error error = peer->readToTheEnd().error();
    EXPECT_EQ(error.code(), v1::ERROR_CODE_CUT_OFF);
    EXPECT_THAT(error.text(), HasSubstr("joined no scene within 10 s"));
    EXPECT_THAT(error.text(), HasSubstr("send hello soon after connecting (--profile)"));
  }
  EXPECT_FALSE(member.finished());
  EXPECT_EQ(refused(Refusal::helloTimeout), 2u);
}

TEST_F(PeerLimitsTest, DropsSlowUploadAndGivesItsRoomBack) {
  ServerOptions options;
  options.maxUploadBytes = 1000;
  options.silence = 200s;
  options.helloTimeout = 30s;
  START(options);
  TestPeer slow(server()), other(server());
  const Clock::time_point before = Clock::now();
  slow.send(firstChunk(800, 1'000'000));
  checkAt(before + 5s);
  other.send(firstChunk(800, 800));
  EXPECT_THAT(other.readUntil(Body::kError).error().text(), HasSubstr("--max-upload-memory"));
  checkAfter(6s);
  const v1::Error error = slow.readUntil(Body::kError).error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(error.text(), HasSubstr("are slower than"));
  other.send(firstChunk(800, 800));
  checkAfter(50s);
  EXPECT_FALSE(other.finished()) << "the time of an upload is added to that for hello";
  // A complete upload without a use is dropped as well.
  checkAfter(61s);
  EXPECT_THAT(other.readUntil(Body::kError).error().text(), HasSubstr("no scene was created from it"));
  EXPECT_EQ(refused(Refusal::uploads), 1u);
  EXPECT_EQ(refused(Refusal::uploadTime), 2u);
  checkAfter(91s);
  EXPECT_TRUE(other.finished());
}

TEST(UploadBudget, OneAddressTakesOnlyItsShare) {
  UploadBudget budget(100, 60);
  EXPECT_TRUE(budget.take("a", 60));
  EXPECT_FALSE(budget.take("a", 1));
  EXPECT_TRUE(budget.take("b", 40));
  EXPECT_FALSE(budget.take("b", 1)) << "nothing is left";
  budget.giveBack("a", 60);
  EXPECT_TRUE(budget.take("", 60)) << "programs of this machine have no share";
  budget.giveBack("", 60);
  EXPECT_FALSE(budget.take("b", 21));
  EXPECT_TRUE(budget.take("b", 20));
}

TEST_F(PeerLimitsTest, PeerThatSendsTooFastMustWait) {
  ServerOptions options;
  options.maxReadRate = 1;  // MB/s
  START(options);
  const std::shared_ptr<Session> session =
      Session::open(server(), {.peer = "fast", .address = {}, .token = {}}, [] {});
  const std::string message = firstChunk(50'000, 1 << 20).SerializeAsString();
  const auto send = [&] { session->receive(std::as_bytes(std::span(message))); };
  send();
  EXPECT_EQ(session->readPause(), Clock::duration::zero());
  const auto start = Clock::now();
  for (int i = 0; i < 40; ++i) send();
  // 41 times 50 KB, of which 1 MB is the burst, and what time has refilled.
  const double pause = schedule::seconds(session->readPause());
  EXPECT_LE(pause, 1.1);
  EXPECT_GE(pause, 1.04 - schedule::seconds(Clock::now() - start));
}

// Poses of `count` colliders: balls so large that each may be near all of the cloth.
v1::ClientMessage colliders(std::uint32_t count) {
  v1::ClientMessage message;
  for (std::uint32_t id = 1; id <= count; ++id) {
    v1::ParticipantCollider& collider = *message.mutable_collider_poses()->add_colliders();
    collider.set_id(id);
    collider.mutable_pose()->mutable_position()->set_x(3);
    collider.mutable_sphere()->set_radius(1);
  }
  return message;
}

TEST_F(PeerLimitsTest, CollidersOfParticipantsHaveAPrice) {
  const model::Scene scene = tests::smallScene("small");
  constexpr model::DeviceSpeed kSpeed{.nodeStepSeconds = 1e-7, .dispatchSeconds = 0, .workgroupFactor = 1};
  const model::PriceModel price(scene);
  const auto loadOf = [&](double weight) {
    return price.work(scene, static_cast<double>(scene.colliders.size()) + weight).seconds(kSpeed) *
           scene.simulationRate;
  };
  // Each is near all cloth.
  const double all = loadOf(30 * scene::kMostWeight);
  START({}, {}, {.sceneLoad = (all - loadOf(0)) * 1.001, .load = 1e9, .tickSeconds = 0});
  server().budget->setSpeed(kSpeed);
  TestPeer first(server()), second(server());
  first.join();
  second.join();
  first.send(colliders(20));
  second.send(colliders(11));
  // The second needs less than half of the room, so the first has what it leaves.
  const auto collidersSeen = [&](std::size_t count) {
    second.readUntil([&](const Body&) {
      return !second.frames().empty() && second.frames().back().colliders.size() == 1 + count;
    });
  };
  collidersSeen(30);
  first.send(colliders(20));
  const v1::Error error = first.readUntil(Body::kError).error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_FALSE(error.fatal());
  EXPECT_THAT(error.text(), HasSubstr("colliderPoses: 19 of 20 colliders act"));
  EXPECT_EQ(refused(Refusal::colliders), 1u);
  first.leave();
  second.send(colliders(30));
  collidersSeen(30);
}

// A scene whose mesh takes a while to build.
v1::CreateSceneRequest largeMesh() {
  model::Scene scene = tests::smallScene("large");
  scene.cloths[0].mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::disc(150, 0.5f)));
  scene.cloths[0].mass = 100;
  scene.cloths[0].pins.clear();
  scene.cloths[0].pinnedVertices = {0};
  scene.substeps = 100;
  v1::CreateSceneRequest request;
  *request.mutable_scene() = messages::toMessage(scene);
  return request;
}

using Created = tl::expected<v1::CreateSceneResponse, v1::Error>;

Created create(hosting::SceneServer& server, hosting::Wanted wanted) {
  std::promise<Created> done;
  server.unaryCalls.createScene(
      largeMesh(), [&](Created created) { done.set_value(std::move(created)); }, identity::local(),
      std::move(wanted));
  return done.get_future().get();
}

TEST_F(PeerLimitsTest, CreatingASceneEndsWhenThePeerDoesNotWantItAnyMore) {
  START();
  // Whenever the peer goes, the scene is not made. The number of checks depends on the time that loading
  // takes.
  int refused = 0;
  for (int last = 0;; last = 2 * last + 1, ++refused) {
    int left = last;
    const Created created = create(server(), [&] { return left-- > 0; });
    if (created) break;
    EXPECT_THAT(created.error().text(), HasSubstr("the peer that asked for it has left"));
    EXPECT_EQ(left, -1) << "no step follows the one in which the peer went";
    EXPECT_EQ(server().unaryCalls.listScenes().scenes_size(), 2);
  }
  EXPECT_GE(refused, 4);
}

TEST_F(PeerLimitsTest, CreatingASceneHasATimeLimit) {
  ServerOptions options;
  options.maxCreationTime = 1ms;
  START(options);
  const Created created = create(server(), [] { return true; });
  ASSERT_FALSE(created);
  EXPECT_EQ(created.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(created.error().text(), HasSubstr("createScene: takes longer than"));
  EXPECT_EQ(refused(Refusal::creationTime), 1u);
}

TEST_F(PeerLimitsTest, EndOfTheServerCancelsTheSceneThatIsBeingCreated) {
  START();
  std::promise<void> begun;
  std::promise<Created> done;
  int steps = 0;
  std::atomic<bool> ending = false;
  server().unaryCalls.createScene(
      largeMesh(), [&](Created created) { done.set_value(std::move(created)); }, identity::local(),
      [&] {
        if (++steps == 2) begun.set_value();
        // Holds the third step until the server ends, so that the test does not depend on the time of steps.
        if (steps == 3)
          while (!ending) std::this_thread::yield();
        return true;
      });
  begun.get_future().wait();
  server().stop();
  ending = true;
  const Created created = done.get_future().get();
  ASSERT_FALSE(created);
  EXPECT_THAT(created.error().text(), HasSubstr("the server stops"));
}

}  // namespace
}  // namespace clothstream::session
