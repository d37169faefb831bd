// SPDX-License-Identifier: MIT
// Joining, frames, input and notices, as peers see them.
#include <algorithm>
#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <set>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/sinks/sink.h>
#include <spdlog/spdlog.h>

#include "server/model/material.h"
#include "server/scene/live_scene.h"
#include "server/scene/scene_observer.h"
#include "tests/serving/server_test.h"

namespace clothstream::session {
namespace {

using namespace schedule;
using namespace delivery;
using namespace hosting;

using testing::HasSubstr;
using tests::SeenFrame;
using tests::TestPeer;
using Body = v1::ServerMessage;

// Starts the server. Leaves the test if there is no device.
#define START(...)    \
  start(__VA_ARGS__); \
  if (IsSkipped()) return

using JoinTest = tests::ServerTest;

// Collider of a participant in a frame; nullptr if there is none.
const v1::ColliderState* colliderOf(const SeenFrame& frame, std::uint64_t participant) {
  const auto found = std::ranges::find(frame.colliders, participant, &v1::ColliderState::participant_id);
  return found == frame.colliders.end() ? nullptr : &*found;
}

TEST_F(JoinTest, SendsWelcomeDescriptionAndFramesFromAKeyFrame) {
  START();
  TestPeer peer(server());
  peer.join();
  EXPECT_EQ(peer.welcome().scene(), "small");
  EXPECT_EQ(peer.welcome().protocol_version(), 1u);
  EXPECT_EQ(peer.welcome().codec(), codec::kCodecHierarchical);
  EXPECT_GT(peer.welcome().participant_id(), 0u);
  EXPECT_EQ(peer.welcome().device_name(), server().device.info().name);
  EXPECT_EQ(peer.description().simulation_rate(), 40u);
  ASSERT_EQ(peer.description().cloths_size(), 1);
  EXPECT_EQ(peer.description().cloths(0).vertex_count(), 120u);
  EXPECT_EQ(peer.description().definition().cloths(0).name(), "sheet");
  EXPECT_EQ(peer.description().colliders(0).name(), "ball");
  EXPECT_TRUE(peer.frames().front().key);

  peer.readFrames(20);
  std::set<std::uint64_t> states;
  for (std::size_t i = 1; i < peer.frames().size(); ++i) {
    EXPECT_GT(peer.frames()[i].tick, peer.frames()[i - 1].tick);
    states.insert(peer.frames()[i].stateHash);
  }
  EXPECT_EQ(states.size(), 20u);  // the cloth moves
}

TEST_F(JoinTest, AllPeersGetTheSameBytesAndALateJoinerTheSameShape) {
  START();
  TestPeer early(server());
  early.join();
  early.readFrames(10);
  TestPeer late(server());
  late.join();
  // Both read alternately, so that neither falls behind.
  for (int i = 0; i < 5; ++i)
    for (TestPeer* peer : {&early, &late}) peer->readFrames(1);
  std::size_t both = 0;
  for (const SeenFrame& mine : late.frames())
    for (const SeenFrame& theirs : early.frames())
      if (mine.tick == theirs.tick) {
        EXPECT_EQ(mine.message, theirs.message);  // the same object
        ++both;
      }
  EXPECT_GT(both, 0u);
  while (early.decoder().tick() != late.decoder().tick())
    (early.decoder().tick() < late.decoder().tick() ? early : late).readFrames(1);
  EXPECT_TRUE(std::ranges::equal(early.decoder().positions(), late.decoder().positions()));
}

TEST_F(JoinTest, AnswersQueriesBeforeAndAfterJoining) {
  START();
  TestPeer peer(server());
  for (int round = 0; round < 2; ++round) {
    v1::ClientMessage list;
    list.set_request_id(11);
    list.mutable_list_scenes();
    peer.send(list);
    v1::ServerMessage answer = peer.readUntil(Body::kListScenes);
    EXPECT_EQ(answer.request_id(), 11u);
    ASSERT_EQ(answer.list_scenes().scenes_size(), 2);
    EXPECT_EQ(answer.list_scenes().scenes(0).name(), "small");
    EXPECT_EQ(answer.list_scenes().scenes(0).vertex_count(), 120u);
    EXPECT_EQ(answer.list_scenes().scenes(0).participants(), static_cast<unsigned>(round));
    EXPECT_EQ(answer.list_scenes().scenes(0).running(), round == 1);

    v1::ClientMessage get;
    get.set_request_id(12);
    get.mutable_get_scene()->set_name("other");
    peer.send(get);
    answer = peer.readUntil(Body::kGetScene);
    EXPECT_EQ(answer.request_id(), 12u);
    EXPECT_EQ(answer.get_scene().scene().name(), "other");

    get.mutable_get_scene()->set_name("nowhere");
    peer.send(get);
    answer = peer.readUntil(Body::kError);
    EXPECT_EQ(answer.request_id(), 12u);
    EXPECT_EQ(answer.error().code(), v1::ERROR_CODE_NOT_FOUND);
    EXPECT_FALSE(answer.error().fatal());

    v1::ClientMessage ping;
    ping.set_request_id(13);
    ping.mutable_ping()->set_client_time_us(99);
    peer.send(ping);
    answer = peer.readUntil(Body::kPong);
    EXPECT_EQ(answer.request_id(), 13u);
    EXPECT_EQ(answer.pong().client_time_us(), 99u);
    EXPECT_GT(answer.pong().server_time_us(), 0u);
    if (round == 0) peer.join();
  }
}

// Calls a function when a participant joins a scene.
class JoinObserver final : public scene::Observer {
 public:
  std::unique_ptr<scene::SceneObserver> observe(const scene::LiveScene&) override {
    return std::make_unique<OfScene>(whenJoined);
  }
  scene::ObserverStatus status() const override { return {}; }

  const std::shared_ptr<std::function<void()>> whenJoined = std::make_shared<std::function<void()>>();

 private:
  struct OfScene final : scene::SceneObserver {
    explicit OfScene(std::shared_ptr<std::function<void()>> function) : whenJoined(std::move(function)) {}
    void joined(const scene::Participant&, const scene::Subject&) override {
      if (*whenJoined) (*whenJoined)();
    }
    void left(const scene::Participant&, const scene::Subject&, Clock::duration) override {}
    const std::shared_ptr<std::function<void()>> whenJoined;
  };
};

TEST_F(JoinTest, ASceneThatIsStoppedWhileAPeerJoinsRefusesIt) {
  const auto observer = std::make_shared<JoinObserver>();
  ServerOptions options;
  options.observer = observer;
  START(std::move(options));
  const std::shared_ptr<scene::LiveScene> other = server().scenes.find("other");
  *observer->whenJoined = [&] {
    other->refuseUntil(Clock::now() + std::chrono::seconds(60), "it is stopped");
  };
  TestPeer peer(server());
  peer.hello("other");
  const v1::ServerMessage last = peer.readToTheEnd();
  EXPECT_EQ(last.error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(last.error().text(), HasSubstr("it is stopped; join again in"));
  EXPECT_EQ(other->roster.size(), 0u);
}

TEST_F(JoinTest, SceneSleepsWithoutSubscribersAndContinues) {
  START();
  std::uint64_t left = 0;
  {
    TestPeer peer(server());
    peer.join();
    peer.readFrames(5);
    left = peer.frames().back().tick;
  }
  TestPeer other(server());  // keeps the server busy meanwhile
  other.join("other");
  other.readFrames(20);
  EXPECT_FALSE(server().unaryCalls.listScenes().scenes(0).running());
  TestPeer again(server());
  again.join();
  EXPECT_GT(again.frames().front().tick, left);
  EXPECT_LT(again.frames().front().tick, left + 10);
}

TEST_F(JoinTest, AlwaysRunningServerNeedsNoSubscribers) {
  ServerOptions options;
  options.runAlways = true;
  START(options);
  const auto ticks = [&] { return metrics().ticks.value(); };
  for (int i = 0; i < 1000 && ticks() < 5; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_GE(ticks(), 5u);
  EXPECT_TRUE(server().unaryCalls.listScenes().scenes(0).running());
}

TEST_F(JoinTest, PeerThatNeverReadsDoesNotDelayOthers) {
  START();
  TestPeer reader(server()), dead(server());
  reader.join();
  dead.hello();
  // The endpoint of `dead` sends one frame and then nothing more.
  dead.readFrames(1);
  dead.acknowledges = false;
  const std::uint64_t keys = metrics().keyFrames.value();
  reader.readFrames(80);  // 2 s
  for (std::size_t i = 1; i < 80; ++i) EXPECT_FALSE(reader.frames()[reader.frames().size() - i].key);
  EXPECT_EQ(metrics().keyFrames.value(), keys);
  // The server holds only a few frames, for the other peer. All others belong to the reader alone.
  std::size_t held = 0;
  for (const SeenFrame& frame : reader.frames()) held += frame.message.use_count() > 1;
  EXPECT_LE(held, HeldFrames::kMax + 1);
  EXPECT_FALSE(dead.finished());
}

TEST_F(JoinTest, PeerThatNeverAcknowledgesGetsTwoFrames) {
  START();
  TestPeer reader(server()), mute(server());
  reader.join();
  mute.acknowledges = false;
  mute.hello();
  mute.readFrames(2);
  reader.readFrames(40);
  v1::ClientMessage ping;
  ping.mutable_ping();
  mute.send(ping);
  mute.readUntil(Body::kPong);  // no other message waits
  EXPECT_EQ(mute.frames().size(), 2u);
}

TEST_F(JoinTest, SlowReaderGetsOnlyDecodableFrames) {
  START();
  TestPeer reader(server()), slow(server());
  reader.join();
  slow.acknowledges = false;
  slow.hello();
  slow.readFrames(2);
  for (int round = 0; round < 4; ++round) {
    reader.readFrames(12);  // 300 ms, in which `slow` falls behind by more frames than its mailbox holds
    v1::ClientMessage ack;
    ack.mutable_frame_ack()->set_tick(slow.frames().back().tick);
    slow.send(ack);
    const std::size_t before = slow.frames().size();
    slow.readFrames(2);  // also decodes them and compares the hashes
    EXPECT_TRUE(slow.frames()[before].key);
    EXPECT_FALSE(slow.frames()[before + 1].key);
  }
  EXPECT_GT(metrics().framesDropped.value(), 0u);
}

TEST_F(JoinTest, SendsAKeyFrameOnRequest) {
  START();
  TestPeer peer(server());
  peer.join();
  peer.readFrames(6);
  v1::ClientMessage request;
  request.mutable_key_frame_request()->set_epoch(peer.description().epoch());
  peer.send(request);
  peer.readFrames(1);
  EXPECT_TRUE(peer.frames().back().key);
}

// A client core derives times of the server's clock from its own clock. After a step of that clock both times
// are wrong until the core notices.
TEST_F(JoinTest, ClientClockJumpOfAnHourKeepsItsColliders) {
  START();
  TestPeer peer(server());
  peer.join();
  v1::ClientMessage message;
  v1::ParticipantCollider& hand = *message.mutable_collider_poses()->add_colliders();
  hand.set_id(1);
  hand.mutable_sphere()->set_radius(0.1f);
  const auto shownAt = [&] {
    const v1::ColliderState* state = colliderOf(peer.frames().back(), peer.welcome().participant_id());
    return state == nullptr ? -1 : state->position().x();
  };
  constexpr std::int64_t kHour = 3'600'000'000;  // us
  float x = 0;
  for (const std::int64_t off : {std::int64_t{0}, kHour, -kHour, std::int64_t{0}}) {
    x += 5;  // a jump, which is not extrapolated
    hand.mutable_pose()->mutable_position()->set_x(x);
    const auto now = static_cast<std::int64_t>(microseconds(Clock::now()));
    message.mutable_collider_poses()->set_client_time_us(static_cast<std::uint64_t>(now + 2 * kHour + off));
    message.mutable_collider_poses()->set_server_time_us(
        static_cast<std::uint64_t>(std::max<std::int64_t>(1, now + off)));
    peer.send(message);
    // The pose acts at once: after the frames in flight and the tick that applies it.
    for (int frames = 0; frames < 8 && shownAt() != x; ++frames) peer.readFrames(1);
    EXPECT_EQ(shownAt(), x) << off;
  }
  EXPECT_FALSE(peer.finished());
  EXPECT_EQ(server().unaryCalls.listScenes().scenes(0).participants(), 1u);
}

TEST_F(JoinTest, PosesMoveCollidersForAllPeersUntilTheParticipantLeaves) {
  START();
  TestPeer watcher(server());
  watcher.join();
  auto hand = std::make_unique<TestPeer>(server());
  hand->join();
  const std::uint64_t participant = hand->welcome().participant_id();
  EXPECT_EQ(colliderOf(watcher.frames().back(), participant), nullptr);
  for (const float x : {0.25f, 0.5f}) {
    hand->poses({{1, x}});
    watcher.readUntil([&](const Body&) {
      const v1::ColliderState* collider = colliderOf(watcher.frames().back(), participant);
      return collider != nullptr && collider->position().x() == x;
    });
  }
  EXPECT_EQ(colliderOf(watcher.frames().back(), participant)->sphere().radius(), 0.1f);
  EXPECT_GE(metrics().inputToPacket.summary().count, 2u);
  hand->vanish();
  watcher.readUntil([&](const Body&) { return colliderOf(watcher.frames().back(), participant) == nullptr; });
}

TEST_F(JoinTest, ParameterChangeIsAnnouncedAndPartOfLaterDescriptions) {
  START();
  TestPeer changer(server()), watcher(server());
  changer.join();
  watcher.join();
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(4);
  change.add_colliders()->set_name("ball");
  change.mutable_colliders(0)->mutable_position()->set_y(3);
  changer.change(change);
  for (TestPeer* peer : {&changer, &watcher}) {
    const v1::ParameterChanged changed = peer->readUntil(Body::kParameterChanged).parameter_changed();
    EXPECT_EQ(changed.participant_id(), changer.welcome().participant_id());
    EXPECT_EQ(changed.change().wind().value().x(), 4);
    peer->readUntil([&](const Body&) { return peer->frames().back().tick >= changed.tick(); });
    EXPECT_EQ(colliderOf(peer->frames().back(), 0)->position().y(), 3);
  }
  TestPeer late(server());
  late.join();
  EXPECT_EQ(late.description().definition().environment().wind().x(), 4);
  EXPECT_EQ(late.description().definition().colliders(0).pose().position().y(), 3);
}

TEST_F(JoinTest, MaterialChangeIsAnnouncedWithTheDerivedParameters) {
  START();
  TestPeer changer(server());
  changer.join();
  EXPECT_THAT(changer.description().materials(), testing::Contains("wool"));
  v1::ParameterChange change;
  change.add_cloths()->set_material("wool");
  changer.change(change);
  const v1::ParameterChanged changed = changer.readUntil(Body::kParameterChanged).parameter_changed();
  const v1::ClothChange& cloth = changed.change().cloths(0);
  const model::Material& wool = *model::findMaterial("wool");
  EXPECT_EQ(cloth.material(), "wool");
  EXPECT_EQ(cloth.structural().stiffness(), wool.tension);
  EXPECT_EQ(cloth.friction(), wool.friction);
  EXPECT_FLOAT_EQ(cloth.areal_mass(), wool.arealMass);
  EXPECT_TRUE(cloth.solver().has_xpbd());
  changer.readUntil([&](const Body&) { return changer.frames().back().tick >= changed.tick(); });
}

TEST_F(JoinTest, UnhealthyStateIsAnnouncedAndTheStreamContinues) {
  START();
  TestPeer peer(server());
  peer.join();
  // Messages cannot carry this value. The state becomes unhealthy, is rolled back, and then reset.
  ASSERT_TRUE(server().scenes.all().front()->inbox.postChange({.change = tests::gravity(-1e30f)}));
  EXPECT_EQ(peer.readUntil(Body::kNotice).notice().kind(), v1::NOTICE_KIND_ROLLED_BACK);
  peer.readUntil(Body::kNotice);
  peer.readFrames(5);
  EXPECT_TRUE(std::ranges::any_of(peer.frames().end() - 5, peer.frames().end(), &SeenFrame::key));
  EXPECT_EQ(metrics().rollbacks.value(), 1u);
  EXPECT_EQ(metrics().resets.value(), 1u);
}

TEST_F(JoinTest, LostDeviceIsReplacedAndTheStreamContinues) {
  START();
  TestPeer peer(server());
  peer.join();
  peer.readFrames(3);
  const std::uint64_t before = peer.frames().back().tick;
  server().device.simulateDeviceLoss();
  EXPECT_EQ(peer.readUntil(Body::kNotice).notice().kind(), v1::NOTICE_KIND_DEVICE_REBUILT);
  peer.readFrames(5);
  EXPECT_TRUE(std::ranges::any_of(peer.frames().end() - 5, peer.frames().end(), &SeenFrame::key));
  EXPECT_GT(peer.frames().back().tick, before);
  EXPECT_EQ(server().metrics.deviceRebuilds.value(), 1u);
}

TEST_F(JoinTest, PeerThatDoesNotSayHelloIsDisconnected) {
  ServerOptions options;
  options.helloTimeout = std::chrono::milliseconds(300);
  START(options);
  TestPeer reader(server()), stranger(server());
  reader.join();
  while (!stranger.finished()) reader.readFrames(1);
  const v1::Error error = stranger.readToTheEnd().error();
  EXPECT_THAT(error.text(),
              HasSubstr("the client joined no scene within 0.3 s: send hello soon after connecting"));
  EXPECT_TRUE(error.fatal());
  EXPECT_FALSE(reader.finished());
}

TEST_F(JoinTest, SilentPeerIsDisconnected) {
  ServerOptions options;
  options.silence = std::chrono::milliseconds(300);
  START(options);
  TestPeer reader(server()), silent(server()), stranger(server());
  reader.join();
  silent.acknowledges = false;
  silent.hello();
  while (!silent.finished() || !stranger.finished()) reader.readFrames(1);
  EXPECT_THAT(stranger.readToTheEnd().error().text(), HasSubstr("the client was silent for 0.3 s"));
  EXPECT_TRUE(silent.readToTheEnd().error().fatal());
  reader.readFrames(10);
  EXPECT_FALSE(reader.finished());
  EXPECT_EQ(server().unaryCalls.listScenes().scenes(0).participants(), 1u);
}

TEST_F(JoinTest, FullSceneAndFullServerRefuseWithTheReason) {
  ServerOptions options;
  options.maxParticipants = 1;
  options.maxConnections = 3;
  START(options);
  TestPeer first(server()), second(server()), third(server()), fourth(server());
  const v1::Error full = fourth.readToTheEnd().error();
  EXPECT_EQ(full.code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(full.text(), HasSubstr("3 connections"));
  first.join();
  second.hello();
  EXPECT_EQ(second.readToTheEnd().error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  third.join("other");
  first.leave();
  TestPeer fifth(server());
  fifth.join();
}

// A server with a scene whose stream has three qualities.
class QualityTest : public ::testing::Test {
 protected:
  void SetUp() override {
    model::Scene scene = tests::smallScene();
    scene.stream.qualities = 3;
    ServerOptions options;
    options.defaultScene = "small";
    try {
      server = std::make_unique<SceneServer>(std::vector{scene}, options);
    } catch (const vulkan::DeviceError& error) {
      GTEST_SKIP() << error.what();
    }
  }
  static v1::Hello wanting(std::uint32_t quality) {
    v1::Hello hello;
    hello.set_quality(quality);
    return hello;
  }
  telemetry::SceneMetrics& metrics() { return server->scenes.all().front()->metrics; }

  std::unique_ptr<SceneServer> server;
};

TEST_F(QualityTest, EachPeerGetsTheRequestedQuality) {
  TestPeer fine(*server), coarse(*server), coarser(*server);
  fine.hello(wanting(0));
  coarse.hello(wanting(1));
  coarser.hello(wanting(3));  // coarser than the stream's coarsest
  for (int i = 0; i < 10; ++i)
    for (TestPeer* peer : {&fine, &coarse, &coarser}) peer->readFrames(1);
  EXPECT_EQ(fine.description().qualities(), 3u);
  std::uint8_t quality = 0;
  for (const TestPeer* peer : {&fine, &coarse, &coarser}) {
    EXPECT_EQ(peer->frames().front().quality, quality);
    // On a busy machine link adaptation may lower the quality.
    for (const SeenFrame& frame : peer->frames()) EXPECT_GE(frame.quality, quality);
    ++quality;
  }
}

TEST_F(QualityTest, RefusesQualityOutOfRange) {
  TestPeer peer(*server);
  peer.hello(wanting(4));
  const v1::Error error = peer.readToTheEnd().error();
  EXPECT_EQ(error.code(), v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THAT(error.text(), HasSubstr("hello.quality = 4"));
}

TEST_F(QualityTest, UnacknowledgedFramesLowerTheQualityUntilAcknowledged) {
  TestPeer other(*server), slow(*server);
  other.hello(wanting(0));
  slow.hello(wanting(0));
  other.readFrames(1);
  slow.readFrames(1);
  slow.acknowledges = false;
  other.readFrames(60);
  slow.acknowledges = true;
  v1::ClientMessage ack;
  ack.mutable_frame_ack()->set_tick(slow.frames().back().tick);
  slow.send(ack);
  slow.readUntil([&](const v1::ServerMessage&) { return slow.frames().back().quality == 2; });
  slow.readUntil([&](const v1::ServerMessage&) { return slow.frames().back().quality == 0; });
  EXPECT_GE(metrics().stepsDown.value(), 1u);
  EXPECT_GE(metrics().stepsUp.value(), 2u);
}

TEST_F(JoinTest, StoppingServerNotifiesAllPeers) {
  START();
  TestPeer joined(server()), stranger(server());
  joined.join();
  server().stop();
  for (TestPeer* peer : {&joined, &stranger}) {
    EXPECT_EQ(peer->readToTheEnd().notice().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
    EXPECT_TRUE(peer->finished());
  }
  TestPeer tooLate(server());
  EXPECT_EQ(tooLate.readToTheEnd().notice().kind(), v1::NOTICE_KIND_SERVER_STOPPING);
}

// While it lives, it calls `action` with each line of the log, on the thread that logs it. No other thread
// may log while it is created or destroyed.
class LogTap {
 public:
  explicit LogTap(std::function<void(std::string_view)> action)
      : sink_(std::make_shared<Sink>(std::move(action))) {
    spdlog::default_logger()->sinks().push_back(sink_);
  }
  ~LogTap() { std::erase(spdlog::default_logger()->sinks(), sink_); }
  LogTap(const LogTap&) = delete;
  LogTap& operator=(const LogTap&) = delete;

 private:
  // Without a lock, because the action may write to the log.
  class Sink final : public spdlog::sinks::sink {
   public:
    explicit Sink(std::function<void(std::string_view)> action) : action_(std::move(action)) {}

    void log(const spdlog::details::log_msg& line) override {
      action_({line.payload.data(), line.payload.size()});
    }
    void flush() override {}
    void set_pattern(const std::string&) override {}
    void set_formatter(std::unique_ptr<spdlog::formatter>) override {}

   private:
    const std::function<void(std::string_view)> action_;
  };

  const spdlog::sink_ptr sink_;
};

TEST_F(JoinTest, JoinOfAnExpiringSceneSaysWhyItEnds) {
  std::promise<std::unique_ptr<TestPeer>> joined;
  // The server writes this line after it has found the scene empty, and before it deletes the scene.
  const LogTap tap([&](std::string_view line) {
    if (!line.starts_with("idle: unused for")) return;
    auto peer = std::make_unique<TestPeer>(server());
    peer->hello("idle");
    joined.set_value(std::move(peer));
  });
  ServerOptions options;
  options.sceneLifetime = std::chrono::milliseconds(100);
  START(options);
  v1::CreateSceneRequest request;
  request.set_named("small");
  request.set_name("idle");
  std::promise<bool> created;
  server().unaryCalls.createScene(request, [&](const auto& made) { created.set_value(made.has_value()); });
  EXPECT_TRUE(created.get_future().get());
  auto arrival = joined.get_future();
  ASSERT_EQ(arrival.wait_for(TestPeer::kPatience), std::future_status::ready);
  {
    const std::unique_ptr<TestPeer> peer = arrival.get();
    const v1::Notice last = peer->readToTheEnd().notice();
    EXPECT_EQ(last.kind(), v1::NOTICE_KIND_SCENE_DELETED);
    EXPECT_EQ(last.text(),
              "the scene 'idle' has expired, because it had no participants for 0.1 s (--scene-lifetime): "
              "create it again");
  }
  stop();
}

TEST_F(JoinTest, ReportShowsTheStagesOfATick) {
  START();
  TestPeer peer(server());
  peer.join();
  peer.readFrames(5);
  const std::string report = server().report();
  for (const char* part :
       {"scene small", "tick", "device", "advance", "entropy coding", "send", "connections 1"})
    EXPECT_THAT(report, HasSubstr(part));
  EXPECT_THAT(report, testing::Not(HasSubstr("scene other")));  // scene "other" never had subscribers
}

TEST(SceneServer, MissingDefaultSceneErrorListsTheScenes) {
  ServerOptions options;
  options.defaultScene = "nowhere";
  try {
    SceneServer server({tests::smallScene("one"), tests::smallScene("two")}, options);
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "there is no scene 'nowhere'; there are one, two");
  }
}

}  // namespace
}  // namespace clothstream::session
