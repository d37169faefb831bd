// SPDX-License-Identifier: MIT
// Scenes that move between servers, and scenes of a server that is gone.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/delivery/mailbox.h"
#include "server/fleet/bucket.h"
#include "server/fleet/conversation.h"
#include "server/fleet/message_bytes.h"
#include "server/fleet/subjects.h"
#include "server/identity/authenticator.h"
#include "server/identity/token.h"
#include "tests/fleet/fleet_test.h"
#include "tests/identity/key_directory.h"

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using tests::eventually;
using tests::SeenFrame;
using tests::TestPeer;

class MovingTest : public tests::FleetTest {
 protected:
  // Starts two servers, a scene "moves" on the first one, and an edge.
  void startTwo() {
    first_ = startOrigin();
    second_ = startOrigin();
    ASSERT_THAT(first_->create("moves"), IsEmpty());
    ASSERT_TRUE(
        eventually([&] { return first_->owns("moves") && !first_->origin->directory().others().empty(); }));
    edge_ = startEdge("moves");
  }
  static std::map<std::uint64_t, std::uint64_t> hashesOf(const TestPeer& peer) {
    std::map<std::uint64_t, std::uint64_t> hashes;
    for (const SeenFrame& frame : peer.frames()) hashes[frame.tick] = frame.stateHash;
    return hashes;
  }

  std::unique_ptr<OriginServer> first_, second_;
  std::unique_ptr<EdgeServer> edge_;
};

TEST_F(MovingTest, StateEqualsThatOfASceneThatNeverMoved) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  TestPeer viewer(edge_->server), peer(edge_->server);
  viewer.role = v1::ROLE_VIEWER;
  viewer.join("moves");
  peer.join("moves");
  viewer.readFrames(20);
  peer.readFrames(20);
  const auto moved = first_->origin->move("moves");
  ASSERT_THAT(moved.error(), IsEmpty());
  EXPECT_EQ(moved.to(), second_->origin->id());
  RecordProperty("gap_ms", static_cast<int>(moved.gap() * 1000));
  EXPECT_EQ(first_->find("moves"), nullptr);
  const auto scene = second_->find("moves");
  ASSERT_NE(scene, nullptr);
  const std::uint64_t tick = scene->tick;
  while (viewer.frames().back().tick < tick + 60) viewer.readFrames(5);
  while (peer.frames().back().tick < tick + 60) peer.readFrames(5);
  EXPECT_EQ(scene->roster.size(), 1u);
  EXPECT_EQ(scene->roster.away(), 0u);

  // The same scene on a server that is alone.
  hosting::SceneServer alone({tests::smallScene("small"), tests::smallScene("other")}, options());
  TestPeer still(alone);
  still.join("other");
  while (still.frames().back().tick < tick + 60) still.readFrames(20);
  const auto expected = hashesOf(still);
  std::size_t compared = 0;
  for (const TestPeer* seen : {&viewer, &peer})
    for (const auto& [at, hash] : hashesOf(*seen)) {
      const auto found = expected.find(at);
      if (found == expected.end()) continue;
      EXPECT_EQ(hash, found->second) << "tick " << at;
      compared += at > tick ? 1 : 0;
    }
  EXPECT_GT(compared, 10u);
  alone.stop();
}

TEST_F(MovingTest, NamesRolesCollidersAndInputsStay) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  TestPeer peer(edge_->server);
  peer.join("moves");
  peer.poses({{0, 0.25F}});
  const std::uint64_t id = peer.welcome().participant_id();
  const auto hasCollider = [&](const v1::ServerMessage& message) {
    return std::ranges::any_of(message.frame().colliders(), [&](const v1::ColliderState& collider) {
      return collider.participant_id() == id;
    });
  };
  peer.readUntil(hasCollider);
  std::atomic<bool> moved = false;
  std::thread mover([&] {
    EXPECT_THAT(first_->origin->move("moves").error(), IsEmpty());
    moved = true;
  });
  // Changes go on while the scene moves. Each is confirmed once, in order.
  v1::ParameterChange change;
  std::vector<float> winds;
  float sent = 0;
  const auto read = [&](const v1::ServerMessage& message) {
    EXPECT_FALSE(message.has_error()) << message.error().text();
    if (message.has_frame()) {
      EXPECT_TRUE(hasCollider(message));
    }
    if (!message.has_parameter_changed() || !message.parameter_changed().change().has_wind()) return false;
    winds.push_back(message.parameter_changed().change().wind().value().x());
    return winds.back() == sent;
  };
  do {
    change.mutable_wind()->mutable_value()->set_x(sent += 0.1F);
    peer.change(change);
    peer.readUntil(read);
  } while (!moved);
  mover.join();
  for (int i = 0; i < 5; ++i) {
    change.mutable_wind()->mutable_value()->set_x(sent += 0.1F);
    peer.change(change);
    peer.readUntil(read);
  }
  EXPECT_TRUE(std::ranges::is_sorted(winds));
  EXPECT_EQ(std::ranges::adjacent_find(winds), winds.end());
  const auto scene = second_->find("moves");
  ASSERT_NE(scene, nullptr);
  const scene::SavedRoster roster = scene->roster.saved();
  ASSERT_EQ(roster.participants.size(), 1u);
  EXPECT_EQ(roster.participants[0].participant.id, id);
  EXPECT_EQ(roster.participants[0].participant.role, scene::Role::owner);
  EXPECT_EQ(roster.participants[0].participant.clientName, "test");
}

TEST_F(MovingTest, DirectClientsLearnTheNewServer) {
  first_ = startOrigin();
  second_ = startOrigin({.publicName = "second.example.com"});
  ASSERT_THAT(first_->create("moves"), IsEmpty());
  ASSERT_TRUE(
      eventually([&] { return first_->owns("moves") && !first_->origin->directory().others().empty(); }));
  TestPeer direct(first_->server);
  direct.join("moves");
  auto moved = std::async(std::launch::async, [&] { return first_->origin->move("moves"); });
  EXPECT_EQ(direct.readUntil(v1::ServerMessage::kMoving).moving().server(), "second.example.com");
  ASSERT_THAT(moved.get().error(), IsEmpty());
  const auto last = direct.readToTheEnd();
  EXPECT_EQ(last.error().code(), v1::ERROR_CODE_CUT_OFF);
  EXPECT_THAT(last.error().text(), HasSubstr("second.example.com"));
  // Its place is kept at the other server.
  v1::Hello hello;
  hello.set_scene("moves");
  hello.set_resume_token(direct.welcome().resume_token());
  TestPeer again(second_->server);
  again.hello(hello);
  again.readUntil(v1::ServerMessage::kWelcome);
  EXPECT_TRUE(again.welcome().resumed());
}

TEST_F(MovingTest, ARenewedTokenComesAlong) {
  // The second server knows only the key of the renewed token.
  const tests::KeyDirectory both, second;
  const identity::TokenKey former = both.make("former.pem"), renewed = both.make("renewed.pem");
  std::filesystem::copy_file(both.path() / "renewed.pem", second.path() / "renewed.pem");
  const auto start = [&](const tests::KeyDirectory& keys) {
    hosting::ServerOptions asking = options();
    asking.authenticator = std::make_shared<identity::Authenticator>(
        identity::AuthenticatorOptions{.keyDirectory = keys.path(), .pairing = false, .stateDirectory = {}});
    return std::make_unique<OriginServer>(natsOptions(), asking);
  };
  const auto sign = [](const identity::TokenKey& key) {
    identity::Claims claims;
    claims.role = scene::Role::owner;
    claims.subject = "anna";
    claims.audience = "clothstream";
    claims.expires = identity::WallClock::now() + 1h;
    return identity::sign(key, claims);
  };
  first_ = start(both);
  second_ = start(second);
  ASSERT_THAT(first_->create("moves"), IsEmpty());
  ASSERT_TRUE(
      eventually([&] { return first_->owns("moves") && !first_->origin->directory().others().empty(); }));
  edge_ = startEdge("moves");
  TestPeer peer(edge_->server, {.peer = "test", .address = {}, .token = sign(former)});
  peer.join("moves");
  v1::ClientMessage renew;
  renew.set_request_id(5);
  renew.mutable_authenticate()->set_token(sign(renewed));
  peer.send(renew);
  peer.readUntil([](const v1::ServerMessage& answer) { return answer.request_id() == 5; });
  ASSERT_THAT(first_->origin->move("moves").error(), IsEmpty());
  const std::uint64_t tick = second_->find("moves")->tick;
  while (peer.frames().back().tick <= tick + 30) peer.readFrames(5);
  EXPECT_EQ(second_->find("moves")->roster.away(), 0u);
}

TEST_F(MovingTest, ASceneStaysWhereItIsIfItCannotMove) {
  first_ = startOrigin();
  EXPECT_THAT(first_->origin->move("none").error(), HasSubstr("no scene 'none'"));
  ASSERT_TRUE(eventually([&] { return first_->owns("small"); }));
  EXPECT_THAT(first_->origin->move("small").error(), HasSubstr("only created ones move"));
  ASSERT_THAT(first_->create("moves"), IsEmpty());
  ASSERT_TRUE(eventually([&] { return first_->owns("moves"); }));
  EXPECT_THAT(first_->origin->move("moves").error(), HasSubstr("no other server"));
  EXPECT_THAT(first_->origin->move("moves", 7).error(), HasSubstr("no such server"));
  EXPECT_THAT(first_->origin->move("moves", first_->origin->id()).error(), HasSubstr("has it already"));

  // A server without room, and one of an earlier version.
  hosting::ServerOptions full = options();
  full.maxCreatedScenes = 0;
  OriginServer second(natsOptions(), full);
  ASSERT_TRUE(eventually([&] { return first_->origin->directory().others().size() == 1; }));
  EXPECT_THAT(first_->origin->move("moves").error(), HasSubstr("no other server"));
  EXPECT_THAT(first_->origin->move("moves", second.origin->id()).error(), HasSubstr("its maximum"));
  TestPeer direct(first_->server);
  direct.join("moves");
  direct.readFrames(5);
}

TEST_F(MovingTest, ScenesMoveOnlyToTheSameOrALaterVersion) {
  first_ = startOrigin({.version = 2000});
  second_ = startOrigin({.version = 1999});
  ASSERT_THAT(first_->create("moves"), IsEmpty());
  ASSERT_TRUE(
      eventually([&] { return first_->owns("moves") && !first_->origin->directory().others().empty(); }));
  EXPECT_THAT(first_->origin->move("moves").error(), HasSubstr("no other server"));
  EXPECT_THAT(first_->origin->move("moves", second_->origin->id()).error(), HasSubstr("older"));
}

TEST_F(MovingTest, AServerThatStopsMovesItsScenes) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  TestPeer peer(edge_->server);
  peer.join("moves");
  // A scene that was deleted just now is nothing to move.
  ASSERT_THAT(first_->create("brief"), IsEmpty());
  ASSERT_TRUE(eventually([&] { return first_->owns("brief"); }));
  ASSERT_THAT(first_->remove("brief"), IsEmpty());
  EXPECT_EQ(first_->origin->moveAll(schedule::Clock::now() + 30s), 0u);
  first_.reset();
  peer.readFrames(20);
  EXPECT_FALSE(peer.finished());
  EXPECT_NE(second_->find("moves"), nullptr);
}

TEST_F(MovingTest, ServersThatStopTogetherKeepTheirScenesForTheNext) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  ASSERT_THAT(second_->create("stays"), IsEmpty());
  ASSERT_TRUE(eventually([&] { return second_->owns("stays"); }));
  const auto stop = [](std::unique_ptr<OriginServer>& server) {
    const auto until = schedule::Clock::now() + 20s;
    server->origin->moveAll(until);
    EXPECT_LT(schedule::Clock::now(), until);
    server.reset();
  };
  auto stopped = std::async(std::launch::async, [&] { stop(first_); });
  stop(second_);
  stopped.get();
  const auto third = startOrigin();
  EXPECT_TRUE(eventually([&] { return third->find("moves") != nullptr && third->find("stays") != nullptr; }));
}

// A server in the directory that is none.
class FalseServer {
 public:
  static constexpr std::uint64_t kId = 7;

  explicit FalseServer(const NatsOptions& options)
      : nats_(options, metrics_),
        requests_(nats_.subscribe(serverSubject(kId), [this](const auto&, const auto&, auto data) {
          v1::MoveRequest request;
          if (parse(data, request)) move_ = request.move();
        })) {
    EXPECT_TRUE(eventually([&] { return nats_.connected(); }));
    renew();
  }
  // Its lease begins again.
  void renew() {
    v1::ServerEntry entry;
    entry.set_origin(kId);
    Bucket(nats_, {.name = Directory::kServers}).put("0000000000000007", entry.SerializeAsString());
  }
  // Takes the name of a scene, with a checkpoint that cannot be read.
  void claim(const std::string& scene) const {
    v1::SceneEntry entry;
    entry.set_origin(kId);
    entry.set_created(true);
    entry.mutable_checkpoint()->set_parts(1);
    Bucket(nats_, {.name = Directory::kScenes}).put(scene, entry.SerializeAsString());
  }
  // Side of this server in the move that it is asked for.
  std::unique_ptr<Conversation> talk() {
    EXPECT_TRUE(eventually([&] { return move_ != 0; }));
    return std::make_unique<Conversation>(nats_, moveDownSubject(move_), moveUpSubject(move_), stopping_);
  }

 private:
  telemetry::NatsMetrics metrics_;
  mutable Nats nats_;
  std::atomic<std::uint64_t> move_ = 0;
  std::atomic<bool> stopping_ = false;
  std::unique_ptr<Nats::Subscription> requests_;
};

TEST_F(MovingTest, AMoveToAServerThatIsGoneEndsWithItsLease) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  const FalseServer gone(natsOptions());
  ASSERT_TRUE(eventually([&] { return first_->origin->directory().isThere(FalseServer::kId); }));
  const auto began = schedule::Clock::now();
  EXPECT_THAT(first_->origin->move("moves", FalseServer::kId).error(), HasSubstr("does not answer"));
  EXPECT_LT(schedule::Clock::now() - began, 60s);  // half of the time in which a scene may be loaded
  EXPECT_NE(first_->find("moves"), nullptr);
}

TEST_F(MovingTest, TheOtherServerLearnsThatAMoveFails) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  FalseServer other(natsOptions());
  ASSERT_TRUE(eventually([&] { return first_->origin->directory().isThere(FalseServer::kId); }));
  auto moved =
      std::async(std::launch::async, [&] { return first_->origin->move("moves", FalseServer::kId); });
  const auto talk = other.talk();
  auto message = talk->receive(30s);
  ASSERT_TRUE(message && message->has_prepare());
  // Its state can no longer be read when the other server has loaded it.
  EXPECT_THAT(first_->remove("moves"), IsEmpty());
  other.renew();
  v1::MoveMessage prepared;
  prepared.mutable_prepared();
  talk->send(prepared);
  message = talk->receive(30s);
  ASSERT_TRUE(message);
  EXPECT_THAT(message->refused(), HasSubstr("cannot be read"));
  EXPECT_THAT(moved.get().error(), HasSubstr("cannot be read"));
}

TEST_F(MovingTest, AnotherServerContinuesTheScenesOfOneThatIsGone) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  v1::Hello hello;
  hello.set_scene("moves");
  TestPeer peer(edge_->server);
  peer.join("moves");
  hello.set_resume_token(peer.welcome().resume_token());
  ASSERT_TRUE(eventually([&] {
    peer.readFrames(1);
    return first_->origin->directory().checkpointOf("moves").tick() > 0;
  }));
  // Like a server that was killed: it saves and says nothing more.
  const std::uint64_t tick = first_->find("moves")->tick;
  first_->origin->simulateLoss();
  peer.readToTheEnd();
  ASSERT_TRUE(eventually([&] { return second_->find("moves") != nullptr; }));
  const auto scene = second_->find("moves");
  const double rate = scene->start().simulationRate;
  EXPECT_GT(static_cast<double>(scene->tick) + 5 * rate, static_cast<double>(tick));
  ASSERT_TRUE(eventually([&] {
    TestPeer again(edge_->server);
    again.hello(hello);
    return again.readUntil([](const auto&) { return true; }).welcome().resumed();
  }));
}

// Renewals may be lost for some seconds then, but no server is gone.
TEST_F(MovingTest, AfterAShortRestartOfNatsScenesStayWhereTheyAre) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  ASSERT_TRUE(eventually([&] { return second_->origin->directory().checkpointOf("moves").parts() > 0; }));
  nats_->kill();
  nats_->restart();
  std::this_thread::sleep_for(FleetView::kLease + 7s);
  EXPECT_EQ(second_->find("moves"), nullptr);
  EXPECT_NE(first_->find("moves"), nullptr);
  EXPECT_TRUE(first_->owns("moves"));
  EXPECT_TRUE(eventually([&] { return first_->origin->move("moves").error().empty(); }));
}

TEST_F(MovingTest, TheNameOfASceneWithoutServerWaitsForItsNextServer) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  const FalseServer gone(natsOptions());
  gone.claim("lost");
  const Directory& directory = first_->origin->directory();
  ASSERT_TRUE(eventually([&] { return directory.isTaken("lost"); }));
  ASSERT_TRUE(eventually([&] { return !directory.isTaken("lost"); }));
  EXPECT_THAT(first_->create("lost"), HasSubstr("another server of the fleet"));
}

TEST_F(MovingTest, CheckpointsHaveWhatChangesWhileASceneStandsStill) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  const Directory& directory = first_->origin->directory();
  ASSERT_TRUE(eventually([&] { return directory.checkpointOf("moves").parts() > 0; }));
  const auto before = directory.checkpointOf("moves");
  first_->find("moves")->roster.setBans({{.subject = {.tenant = "", .name = "anna"}, .displayName = "Anna"}});
  EXPECT_TRUE(eventually([&] { return directory.checkpointOf("moves").crc() != before.crc(); }));
  EXPECT_EQ(directory.checkpointOf("moves").tick(), before.tick());
}

// A scene that becomes smaller must not fill the store.
TEST_F(MovingTest, PartsOfLargerCheckpointsAreDeleted) {
  telemetry::NatsMetrics metrics;
  Nats nats(natsOptions(), metrics);
  ASSERT_TRUE(eventually([&] { return nats.connected(); }));
  Bucket checkpoints(nats, {.name = Directory::kCheckpoints});
  const std::vector<std::string> old{"moves.0.0", "moves.0.1", "moves.0.2", "moves.1.0",
                                     "moves.1.1", "moves.1.2", "moves.1.3"};
  for (const std::string& key : old) checkpoints.put(key, "old");
  const auto remain = [&] {
    return std::ranges::count_if(old,
                                 [&](const std::string& key) { return checkpoints.get(key).has_value(); });
  };
  first_ = startOrigin();
  ASSERT_THAT(first_->create("moves"), IsEmpty());
  const Directory& directory = first_->origin->directory();
  ASSERT_TRUE(eventually([&] { return directory.checkpointOf("moves").parts() > 0; }));
  EXPECT_TRUE(eventually([&] { return remain() <= 5; })) << "one part of the slot that was written";
  EXPECT_TRUE(checkpoints.get(fmt::format("moves.{}.0", directory.checkpointOf("moves").slot())));
  EXPECT_THAT(first_->remove("moves"), IsEmpty());
  EXPECT_TRUE(eventually([&] { return remain() == 0; }));
}

TEST_F(MovingTest, AMoveThatThrowsIsAnsweredAndCanBeRepeated) {
  first_ = startOrigin();
  second_ = startOrigin({.publicName = "second.example"});
  ASSERT_THAT(first_->create("moves"), IsEmpty());
  ASSERT_TRUE(
      eventually([&] { return first_->owns("moves") && !first_->origin->directory().others().empty(); }));
  // Clients are told of the move through their endpoint.
  std::atomic<bool> fails = false;
  first_->find("moves")->paused = true;  // no frames
  const auto mailbox = std::make_shared<delivery::Mailbox>([&] {
    if (fails.exchange(false)) throw std::runtime_error("as in a test");
  });
  telemetry::SceneMetrics metrics;
  mailbox->subscribe(nullptr, {.rate = 60}, metrics);
  first_->find("moves")->subscribers.add(mailbox);
  fails = true;
  EXPECT_THAT(first_->origin->move("moves").error(), HasSubstr("failed on this server: as in a test"));
  EXPECT_FALSE(fails);
  ASSERT_NE(first_->find("moves"), nullptr);
  EXPECT_THAT(first_->origin->move("moves").error(), IsEmpty());
  EXPECT_NE(second_->find("moves"), nullptr);
}

TEST_F(MovingTest, ANameIsGivenOnceInAFleet) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  ASSERT_TRUE(eventually([&] { return second_->origin->directory().isTaken("moves"); }));
  EXPECT_THAT(second_->create("moves"), HasSubstr("another server of the fleet"));
  EXPECT_THAT(second_->create("other-name"), IsEmpty());
}

TEST_F(MovingTest, AServerThatWasGoneGivesUpWhatAnotherOneContinues) {
  ASSERT_NO_FATAL_FAILURE(startTwo());
  TestPeer direct(first_->server);
  direct.join("moves");
  ASSERT_TRUE(eventually([&] {
    direct.readFrames(1);
    return first_->origin->directory().checkpointOf("moves").tick() > 0;
  }));
  first_->origin->simulateLoss();
  ASSERT_TRUE(eventually([&] { return second_->find("moves") != nullptr; }));
  direct.readFrames(5);  // who is connected to it notices nothing so far
  first_->origin.reset();
  first_->origin = std::make_unique<Origin>(first_->server, natsOptions());
  EXPECT_EQ(direct.readToTheEnd().error().code(), v1::ERROR_CODE_CUT_OFF);
  EXPECT_TRUE(eventually([&] { return first_->find("moves") == nullptr; }));
  EXPECT_NE(second_->find("moves"), nullptr);
}

}  // namespace
}  // namespace clothstream::fleet
