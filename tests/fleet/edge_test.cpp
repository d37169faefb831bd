// SPDX-License-Identifier: MIT
// Viewers on an edge: what they see of a scene that another server simulates, and what they see when a part
// of the fleet is lost.
#include "server/fleet/edge.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/fleet.pb.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/origin.h"
#include "server/fleet/subjects.h"
#include "tests/fleet/nats_server.h"
#include "tests/serving/server_test.h"
#include "tests/support/eventually.h"

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using tests::eventually;
using tests::SeenFrame;
using tests::TestPeer;

struct Viewer : TestPeer {
  explicit Viewer(hosting::SceneServer& server) : TestPeer(server) { role = v1::ROLE_VIEWER; }
};

class EdgeTest : public tests::ServerTest {
 protected:
  void SetUp() override {
    nats_ = tests::NatsServer::start();
    if (!nats_) GTEST_SKIP() << "there is no nats-server (apt install nats-server)";
  }

  NatsOptions natsOptions() const {
    return {.servers = {nats_->url()}, .credentials = {}, .authority = {}, .name = "test", .role = "test"};
  }

  void startOrigin(hosting::ServerOptions options = {}) {
    options.guestScenes = {"other"};
    start(std::move(options));
    if (!IsSkipped()) origin_ = std::make_unique<Origin>(server(), natsOptions());
  }
  void stopOrigin() {
    origin_.reset();
    server().stop();
    stop();
  }

  // A server with an edge, which knows the scene "small".
  struct EdgeServer {
    EdgeServer(const NatsOptions& nats, std::chrono::milliseconds keep)
        : server(hosting::ServerOptions{}), edge(server, nats, keep) {}
    ~EdgeServer() { server.stop(); }
    bool shows(const std::string& scene) { return server.scenes.find(scene) != nullptr; }

    hosting::SceneServer server;
    Edge edge;
  };
  std::unique_ptr<EdgeServer> startEdge(std::chrono::milliseconds keep = 60s) {
    auto started = std::make_unique<EdgeServer>(natsOptions(), keep);
    EXPECT_TRUE(eventually([&] { return started->shows("small"); }));
    return started;
  }

  // Frames that both peers got are the same bytes. Returns their number.
  static std::size_t sameFrames(const TestPeer& one, const TestPeer& other) {
    std::map<std::uint64_t, const SeenFrame*> of;
    for (const SeenFrame& frame : one.frames()) of[frame.tick] = &frame;
    std::size_t same = 0;
    for (const SeenFrame& frame : other.frames()) {
      const auto found = of.find(frame.tick);
      if (found == of.end() || found->second->key != frame.key) continue;
      EXPECT_EQ(*found->second->message, *frame.message) << "tick " << frame.tick;
      ++same;
    }
    return same;
  }

  static v1::ServerMessage noticeWith(TestPeer& peer, const std::string& text) {
    return peer.readUntil([&](const v1::ServerMessage& message) {
      return message.has_notice() && message.notice().text().find(text) != std::string::npos;
    });
  }

  std::unique_ptr<tests::NatsServer> nats_;
  std::unique_ptr<Origin> origin_;

 private:
  void TearDown() override { origin_.reset(); }
};

TEST_F(EdgeTest, ViewersGetTheFramesOfTheOriginAsTheyAre) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  TestPeer direct(server());
  Viewer viewer(edge->server);
  direct.join("small");
  viewer.join("small");
  EXPECT_EQ(viewer.welcome().role(), v1::ROLE_VIEWER);
  EXPECT_EQ(viewer.welcome().device_name(), direct.welcome().device_name());
  EXPECT_EQ(viewer.description().cloths(0).rest_positions(), direct.description().cloths(0).rest_positions());
  // A slow machine leaves out frames, and not the same ones for both.
  for (int i = 0; i < 100 && sameFrames(direct, viewer) < 20; ++i) {
    viewer.readFrames(4);
    direct.readFrames(4);
  }
  EXPECT_GE(sameFrames(direct, viewer), 20u);
}

TEST_F(EdgeTest, OneStreamServesAllViewers) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  Viewer first(edge->server), second(edge->server), third(edge->server);
  for (TestPeer* peer : {&first, &second, &third}) peer->join();
  third.readFrames(10);
  EXPECT_EQ(metrics().framesTaken.value(), 0u);  // by nobody at the origin
  EXPECT_LE(server().metrics.nats.published.value(), metrics().frames.value() + 40);
}

TEST_F(EdgeTest, AViewerGetsAKeptKeyFrameOfAPausedScene) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  Viewer first(edge->server);
  first.join();
  v1::ControlSceneRequest pause;
  pause.set_paused(true);
  ASSERT_TRUE(server().unaryCalls.controlScene(pause));
  noticeWith(first, "paused");
  // The first viewer that joins now needs a key frame of the origin, the second one gets the same.
  Viewer second(edge->server);
  second.join();
  EXPECT_TRUE(second.frames().back().key);
  // A request that was sent twice because the first answer took long is answered by now.
  std::this_thread::sleep_for(500ms);
  const std::uint64_t keyFrames = metrics().keyFrames.value();
  Viewer third(edge->server);
  third.hello();
  noticeWith(third, "paused");
  third.readFrames(1);
  EXPECT_EQ(third.frames().back().tick, second.frames().back().tick);
  EXPECT_EQ(metrics().keyFrames.value(), keyFrames);
}

TEST_F(EdgeTest, ParametersAreThoseOfTheOrigin) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  TestPeer direct(server());
  Viewer viewer(edge->server);
  direct.join();
  viewer.join();
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(3);
  direct.change(change);
  const auto windOf = [](const v1::ServerMessage& message) {
    return message.parameter_changed().change().wind().value().x();
  };
  viewer.readUntil([&](const v1::ServerMessage& message) { return windOf(message) == 3; });
  Viewer later(edge->server);
  later.hello("small");
  EXPECT_EQ(windOf(later.readUntil(v1::ServerMessage::kParameterChanged)), 3);
  // A viewer cannot change them.
  viewer.change(change);
  const auto refused = viewer.readUntil(v1::ServerMessage::kError);
  EXPECT_FALSE(refused.error().fatal());
  EXPECT_THAT(refused.error().text(), HasSubstr("yours is viewer"));
}

TEST_F(EdgeTest, ViewersLearnWhatChangedWhileNatsWasAway) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  TestPeer direct(server());
  Viewer viewer(edge->server);
  direct.join();
  viewer.join();
  viewer.readFrames(2);
  nats_->kill();
  v1::ParameterChange change;
  change.mutable_wind()->mutable_value()->set_x(3);
  direct.change(change);
  direct.readUntil(v1::ServerMessage::kParameterChanged);
  v1::ControlSceneRequest pause;
  pause.set_name("small");
  pause.set_paused(true);
  ASSERT_TRUE(server().unaryCalls.controlScene(pause));
  nats_->restart();
  bool hasWind = false, isPaused = false;
  viewer.readUntil([&](const v1::ServerMessage& message) {
    hasWind |= message.parameter_changed().change().wind().value().x() == 3;
    isPaused |= message.notice().kind() == v1::NOTICE_KIND_SCENE_PAUSED;
    return hasWind && isPaused;
  });
  nats_->kill();
  pause.set_paused(false);
  ASSERT_TRUE(server().unaryCalls.controlScene(pause));
  nats_->restart();
  viewer.readUntil([](const v1::ServerMessage& message) {
    return message.notice().kind() == v1::NOTICE_KIND_SCENE_RESUMED;
  });
  viewer.readFrames(2);
}

TEST_F(EdgeTest, ASceneThatBeginsAgainIsFollowed) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  Viewer viewer(edge->server);
  viewer.join();
  viewer.readFrames(40);
  const std::uint64_t tick = viewer.frames().back().tick;
  // The device thread gives the scene up, and it runs from the beginning.
  server().device.simulateDeviceLossIn("small");
  ASSERT_TRUE(eventually([&] { return server().scenes.find("small")->restarts > 0; }));
  server().device.simulateDeviceLossIn("");
  EXPECT_EQ(viewer.readToTheEnd().error().code(), v1::ERROR_CODE_CUT_OFF);
  Viewer again(edge->server);
  again.join();
  again.readFrames(5);
  EXPECT_LT(again.frames().front().tick, tick);
}

TEST_F(EdgeTest, OriginSleepsWithoutViewers) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto scene = server().scenes.find("small");
  auto edge = startEdge();
  {
    Viewer viewer(edge->server);
    viewer.join();
    EXPECT_TRUE(eventually([&] { return scene->running.load(); }));
  }
  EXPECT_TRUE(eventually([&] { return !scene->running; }));
  {
    Viewer viewer(edge->server);
    viewer.join();
    viewer.readFrames(10);  // more than the edge keeps
    EXPECT_TRUE(scene->running);
    edge->server.stop();
  }
  edge.reset();  // without a goodbye: the origin forgets it
  EXPECT_TRUE(eventually([&] { return !scene->running; }));
}

TEST_F(EdgeTest, ViewersWaitForNatsAndGoOn) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  TestPeer direct(server());
  Viewer viewer(edge->server);
  direct.join();
  viewer.join();
  nats_->kill();
  noticeWith(viewer, "NATS");
  direct.readFrames(20);  // who is at the origin notices nothing
  nats_->restart();
  viewer.readFrames(10);  // each one is decoded and compared with the origin's hash
  EXPECT_GT(viewer.frames().back().tick, direct.frames().back().tick);
  EXPECT_FALSE(viewer.finished());
}

TEST_F(EdgeTest, AnOriginThatStartsAgainIsFollowed) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  Viewer viewer(edge->server);
  viewer.join();
  stopOrigin();
  noticeWith(viewer, "does not answer");
  startOrigin();
  const auto last = viewer.readToTheEnd();
  EXPECT_EQ(last.error().code(), v1::ERROR_CODE_CUT_OFF);
  EXPECT_THAT(last.error().text(), HasSubstr("was replaced"));
  Viewer again(edge->server);
  again.join("small");
  again.readFrames(5);
}

TEST_F(EdgeTest, ASceneWithoutOriginIsRemoved) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge(500ms);
  Viewer viewer(edge->server);
  viewer.join();
  stopOrigin();
  const auto last = viewer.readToTheEnd();
  EXPECT_EQ(last.error().code(), v1::ERROR_CODE_NOT_FOUND);
  EXPECT_THAT(last.error().text(), HasSubstr("is gone"));
  EXPECT_FALSE(edge->shows("small"));
}

TEST_F(EdgeTest, BuiltInScenesThatEveryServerHasAreNotOffered) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  EXPECT_FALSE(edge->shows("other"));
  Viewer viewer(edge->server);
  viewer.hello("other");
  EXPECT_EQ(viewer.readToTheEnd().error().code(), v1::ERROR_CODE_NOT_FOUND);
}

TEST_F(EdgeTest, ScenesCreatedLaterAreShownAndDeletedOnesEnd) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge(500ms);
  v1::CreateSceneRequest request;
  request.set_named("other");
  request.set_name("copy");
  std::atomic<bool> done = false;
  server().unaryCalls.createScene(request, [&](const auto& created) {
    EXPECT_TRUE(created);
    done = true;
  });
  ASSERT_TRUE(eventually([&] { return done.load(); }));
  ASSERT_TRUE(eventually([&] { return edge->shows("copy"); }));
  Viewer viewer(edge->server);
  viewer.join("copy");
  v1::DeleteSceneRequest remove;
  remove.set_name("copy");
  server().unaryCalls.deleteScene(remove, [](const auto&) {});
  EXPECT_EQ(viewer.readToTheEnd().error().code(), v1::ERROR_CODE_NOT_FOUND);
}

TEST_F(EdgeTest, AServerOfTheSameSceneNameDoesNotReplaceTheFirst) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  Viewer viewer(edge->server);
  viewer.join();
  telemetry::NatsMetrics metrics;
  Nats other(natsOptions(), metrics);
  v1::Offer offer;
  offer.set_origin(7);
  offer.add_scenes()->set_stream(8);
  offer.mutable_scenes(0)->mutable_summary()->set_name("small");
  for (int i = 0; i < 3; ++i) {
    other.publish(kOffers, toBytes(offer));
    viewer.readFrames(5);
  }
  EXPECT_FALSE(viewer.finished());
}

// Subject of the stream of "small", as any program at NATS learns it.
std::string smallStream(Nats& nats) {
  std::atomic<std::uint64_t> stream = 0;
  const auto offers = nats.subscribe(kOffers, [&](const auto&, const auto&, auto data) {
    v1::Offer offer;
    if (parse(data, offer) && offer.scenes_size() > 0) stream = offer.scenes(0).stream();
  });
  EXPECT_TRUE(eventually([&] { return stream != 0; }));
  return streamSubject("small", stream);
}

TEST_F(EdgeTest, AnswersGoToInboxesOnly) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  telemetry::NatsMetrics metrics;
  Nats other(natsOptions(), metrics);
  const std::string elsewhere = "clothstream.moves.1.up", inbox = other.inbox();
  std::atomic<int> strays = 0, answers = 0;
  const auto stray = other.subscribe(elsewhere, [&](const auto&, const auto&, auto) { ++strays; });
  const auto answer = other.subscribe(inbox, [&](const auto&, const auto&, auto) { ++answers; });
  const std::string description = descriptionSubject(smallStream(other));
  // The origin answers in this order.
  other.publish(description, toBytes(v1::ChunkRequest()), elsewhere);
  other.publish(description, toBytes(v1::ChunkRequest()), inbox);
  ASSERT_TRUE(eventually([&] { return answers == 1; }));
  EXPECT_EQ(strays, 0);
}

TEST_F(EdgeTest, MessagesThatDoNotBelongToAStreamAreDropped) {
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  const auto edge = startEdge();
  Viewer viewer(edge->server);
  viewer.join();
  telemetry::NatsMetrics metrics;
  Nats other(natsOptions(), metrics);
  const std::string subject = smallStream(other);
  const auto send = [&](const std::string& where, const std::string& bytes) {
    const auto* const first = reinterpret_cast<const std::byte*>(bytes.data());
    other.publish(where, std::make_shared<std::vector<std::byte>>(first, first + bytes.size()));
  };
  v1::ServerMessage frame, welcome;
  frame.mutable_frame()->set_packet("not a packet");
  welcome.mutable_welcome()->set_scene("small");
  for (const std::string& bytes : {std::string("\xff\xff\xff"), std::string(), frame.SerializeAsString()}) {
    send(framesSubject(subject, 0), bytes);
    send(kOffers, bytes);
    send(interestSubject(subject), bytes);
    send(descriptionSubject(subject), bytes);
  }
  send(eventsSubject(subject), welcome.SerializeAsString());
  EXPECT_TRUE(eventually([&] { return edge->server.metrics.nats.refused.value() >= 4; }));
  viewer.readFrames(10);
  EXPECT_FALSE(viewer.finished());
}

TEST_F(EdgeTest, StartsWithoutNatsAndWithoutOrigin) {
  nats_->kill();
  EdgeServer edge(natsOptions(), 60s);
  EXPECT_FALSE(edge.server.metrics.nats.connected);
  TestPeer early(edge.server);
  early.hello("small");
  EXPECT_EQ(early.readToTheEnd().error().code(), v1::ERROR_CODE_NOT_FOUND);
  nats_->restart();
  ASSERT_NO_FATAL_FAILURE(startOrigin());
  if (IsSkipped()) return;
  ASSERT_TRUE(eventually([&] { return edge.shows("small"); }));
  TestPeer viewer(edge.server);
  viewer.join("small");
}

}  // namespace
}  // namespace clothstream::fleet
