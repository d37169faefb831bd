// SPDX-License-Identifier: MIT
// Participants on an edge: their inputs reach the server that simulates the scene, in order and once.
#include <algorithm>
#include <chrono>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "proto/codec/packet_header.h"
#include "server/endpoint/datagram/datagram_endpoint.h"
#include "tests/endpoint/datagram/datagram_client.h"
#include "tests/fleet/fleet_test.h"

namespace clothstream::fleet {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using tests::eventually;
using tests::TestPeer;

class EdgeParticipantsTest : public tests::FleetTest {
 protected:
  static v1::ParameterChange windOf(float x) {
    v1::ParameterChange change;
    change.mutable_wind()->mutable_value()->set_x(x);
    return change;
  }
  // Winds that the peer is told about, until this one.
  static std::vector<float> windsUntil(TestPeer& peer, float last) {
    std::vector<float> winds;
    peer.readUntil([&](const v1::ServerMessage& message) {
      if (!message.has_parameter_changed() || !message.parameter_changed().change().has_wind()) return false;
      winds.push_back(message.parameter_changed().change().wind().value().x());
      return winds.back() == last;
    });
    return winds;
  }
};

TEST_F(EdgeParticipantsTest, TakePartAsAtTheOrigin) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  TestPeer direct(origin->server), peer(edge->server);
  direct.join("small");
  peer.join("small");
  EXPECT_EQ(direct.welcome().role(), v1::ROLE_OWNER);
  EXPECT_EQ(peer.welcome().role(), v1::ROLE_PARTICIPANT);
  EXPECT_EQ(peer.welcome().participants_size(), 2);
  EXPECT_EQ(origin->find("small")->roster.size(), 2u);
  EXPECT_EQ(edge->server.scenes.find("small")->roster.size(), 0u);

  peer.poses({{0, 0.25F}});
  direct.readUntil([&](const v1::ServerMessage& message) {
    const auto& colliders = message.frame().colliders();
    return std::ranges::any_of(colliders, [&](const v1::ColliderState& collider) {
      return collider.participant_id() == peer.welcome().participant_id();
    });
  });
  direct.change(windOf(2));
  EXPECT_EQ(windsUntil(peer, 2), std::vector<float>{2});
  peer.readFrames(5);  // each one is decoded and compared with the origin's hash

  peer.leave();
  const auto left = direct.readUntil([](const v1::ServerMessage& message) {
    return message.has_presence() && message.presence().kind() == v1::PRESENCE_KIND_LEFT;
  });
  EXPECT_EQ(left.presence().reason(), v1::LEAVE_REASON_LEFT);
}

TEST_F(EdgeParticipantsTest, ErrorsAreThoseOfTheOrigin) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  TestPeer owner(origin->server), peer(edge->server);
  owner.join("small");
  peer.join("small");
  v1::ClientMessage remove;
  remove.mutable_remove_participant()->set_participant_id(owner.welcome().participant_id());
  peer.send(remove);
  EXPECT_THAT(peer.readUntil(v1::ServerMessage::kError).error().text(), HasSubstr("yours is participant"));
  remove.mutable_remove_participant()->set_participant_id(peer.welcome().participant_id());
  owner.send(remove);
  const auto last = peer.readToTheEnd();
  EXPECT_EQ(last.error().code(), v1::ERROR_CODE_REMOVED);
}

TEST_F(EdgeParticipantsTest, AFullSceneIsWatched) {
  hosting::ServerOptions few = options();
  few.maxParticipants = 1;
  OriginServer origin(natsOptions(), few);
  TestPeer owner(origin.server);
  owner.join("small");
  const auto edge = startEdge("small");
  // The edge learns how many there are from the next offer.
  ASSERT_TRUE(eventually([&] {
    TestPeer peer(edge->server);
    peer.hello("small");
    return peer.readUntil([](const auto&) { return true; }).welcome().role() == v1::ROLE_VIEWER;
  }));
}

TEST_F(EdgeParticipantsTest, APlaceInAFullSceneIsKept) {
  hosting::ServerOptions few = options();
  few.maxParticipants = 2;
  OriginServer origin(natsOptions(), few);
  TestPeer owner(origin.server);
  owner.join("small");
  const auto edge = startEdge("small");
  v1::Hello hello;
  hello.set_scene("small");
  TestPeer peer(edge->server);
  peer.join("small");
  hello.set_resume_token(peer.welcome().resume_token());
  // The edge says by now that the scene is full, and the participant is still counted.
  ASSERT_TRUE(eventually([&] {
    TestPeer viewer(edge->server);
    viewer.hello("small");
    return viewer.readUntil([](const auto&) { return true; }).welcome().role() == v1::ROLE_VIEWER;
  }));
  TestPeer again(edge->server);
  again.hello(hello);
  again.readUntil(v1::ServerMessage::kWelcome);
  EXPECT_TRUE(again.welcome().resumed());
  // A client without a place is refused once, and then watches.
  hello.set_resume_token("of another edge");
  TestPeer stranger(edge->server);
  stranger.hello(hello);
  EXPECT_EQ(stranger.readToTheEnd().error().code(), v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  // The newest offer may be of the moment in which the participant came back.
  EXPECT_TRUE(eventually([&] {
    TestPeer viewer(edge->server);
    viewer.hello(hello);
    return viewer.readUntil([](const auto&) { return true; }).welcome().role() == v1::ROLE_VIEWER;
  }));
}

// A ban at the origin holds for viewers of an edge, too.
TEST_F(EdgeParticipantsTest, BansOfTheOriginHoldOnEdges) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  const scene::Subject subject{.tenant = "theatre", .name = "anna"};
  const auto shown = edge->server.scenes.find("small");
  EXPECT_FALSE(shown->roster.isBanned(subject));
  origin->find("small")->roster.setBans({{.subject = subject, .displayName = "Anna"}});
  EXPECT_TRUE(eventually([&] { return shown->roster.isBanned(subject); }));
  origin->find("small")->roster.setBans({});
  EXPECT_TRUE(eventually([&] { return !shown->roster.isBanned(subject); }));
}

// Every change arrives once, in order, although NATS loses its connections in between.
TEST_F(EdgeParticipantsTest, InputsArriveInOrderAndOnceAfterNatsWasLost) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  TestPeer direct(origin->server), peer(edge->server);
  peer.join("small");
  direct.join("small");
  std::vector<float> sent;
  for (int i = 1; i <= 60; ++i) {
    sent.push_back(static_cast<float>(i) / 10);
    peer.change(windOf(sent.back()));
    if (i == 20) nats_->kill();
    if (i == 40) nats_->restart();
    std::this_thread::sleep_for(30ms);
  }
  std::vector<float> winds = windsUntil(direct, sent.back());
  // Changes of one tick are one change, so some are not seen, but none twice and none late.
  EXPECT_TRUE(std::ranges::is_sorted(winds));
  EXPECT_EQ(std::ranges::adjacent_find(winds), winds.end());
  EXPECT_FALSE(peer.finished());
  peer.readFrames(5);
}

// Clients leave a server that does not answer pings.
TEST_F(EdgeParticipantsTest, StayConnectedWhileNatsIsLost) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  TestPeer peer(edge->server);
  peer.join("small");
  const auto ping = [&] {
    v1::ClientMessage message;
    message.mutable_ping()->set_client_time_us(7);
    peer.send(message);
    return peer.readUntil(v1::ServerMessage::kPong).pong();
  };
  const std::uint64_t before = ping().server_time_us();
  nats_->kill();
  std::this_thread::sleep_for(2s);
  const v1::Pong pong = ping();
  EXPECT_EQ(pong.client_time_us(), 7u);
  // Both servers have the clock of this machine.
  EXPECT_GT(pong.server_time_us(), before + 1'500'000);
  EXPECT_LT(pong.server_time_us(), before + 60'000'000);
  nats_->restart();
  peer.readFrames(5);
  EXPECT_GT(ping().server_time_us(), pong.server_time_us());
}

TEST_F(EdgeParticipantsTest, SeeTheScenesOfTheEdge) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  TestPeer peer(edge->server);
  peer.join("small");
  v1::ClientMessage list;
  list.set_request_id(9);
  list.mutable_list_scenes();
  peer.send(list);
  const auto answer = peer.readUntil(v1::ServerMessage::kListScenes);
  EXPECT_EQ(answer.request_id(), 9u);
  ASSERT_EQ(answer.list_scenes().scenes_size(), 1);  // not "other", which the origin has, too
  EXPECT_EQ(answer.list_scenes().scenes(0).name(), "small");
}

TEST_F(EdgeParticipantsTest, ALostEdgeKeepsThePlaceOfItsParticipants) {
  const auto origin = startOrigin();
  auto edge = startEdge("small");
  v1::Hello hello;
  hello.set_scene("small");
  {
    TestPeer peer(edge->server);
    peer.join("small");
    hello.set_resume_token(peer.welcome().resume_token());
  }
  edge.reset();
  edge = startEdge("small");
  TestPeer again(edge->server);
  again.hello(hello);
  again.readUntil(v1::ServerMessage::kWelcome);
  EXPECT_TRUE(again.welcome().resumed());
}

TEST_F(EdgeParticipantsTest, AnOriginThatIsLostCutsThemOff) {
  auto origin = startOrigin();
  const auto edge = startEdge("small");
  TestPeer peer(edge->server);
  peer.join("small");
  origin.reset();
  EXPECT_THAT(peer.readToTheEnd().notice().text(), HasSubstr("stopping"));
}

class EdgeDatagramsTest : public EdgeParticipantsTest {
 protected:
  // Lets the client work until `holds` returns true.
  static bool until(tests::DatagramClient& client, const auto& holds) {
    for (int i = 0; i < 40'000 && !holds(); ++i) {
      client.poll();
      std::this_thread::sleep_for(500us);
    }
    return holds();
  }
  static v1::Frame frameIn(const std::vector<std::byte>& bytes) {
    v1::ServerMessage message;
    EXPECT_TRUE(message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    return message.frame();
  }
  static codec::PacketHeader headerIn(const std::vector<std::byte>& bytes) {
    const v1::Frame frame = frameIn(bytes);
    const auto packet = codec::parsePacket(std::as_bytes(std::span(frame.packet())));
    EXPECT_TRUE(packet);
    return packet ? packet->header : codec::PacketHeader{};
  }
};

TEST_F(EdgeDatagramsTest, CarryFramesAndPosesOfParticipants) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  const endpoint::DatagramEndpoint endpoint(edge->server, {});
  tests::DatagramClient client(edge->server, "small");
  client.offer();
  ASSERT_TRUE(until(client, [&] { return client.datagramFrames.size() >= 20; }));
  EXPECT_EQ(origin->find("small")->roster.size(), 1u) << "a participant of the origin";
  const std::size_t byStream = client.streamFrames.size();

  v1::ClientMessage poses;
  v1::ParticipantCollider& collider = *poses.mutable_collider_poses()->add_colliders();
  collider.mutable_pose()->mutable_position()->set_x(0.25F);
  collider.mutable_sphere()->set_radius(0.1F);
  client.sendDatagram(poses);
  ASSERT_TRUE(until(client, [&] {
    const v1::Frame frame = frameIn(client.datagramFrames.back());
    return std::ranges::any_of(frame.colliders(),
                               [](const auto& each) { return each.participant_id() != 0; });
  }));
  EXPECT_EQ(client.streamFrames.size(), byStream);
  for (std::size_t i = 1; i < client.datagramFrames.size(); ++i) {
    const codec::PacketHeader header = headerIn(client.datagramFrames[i]);
    if (header.kind == codec::PacketKind::key) continue;
    EXPECT_EQ(header.references[0], headerIn(client.datagramFrames[i - 1]).tick);
  }
}

TEST_F(EdgeDatagramsTest, EndWithKeyFrameOnStream) {
  const auto origin = startOrigin();
  const auto edge = startEdge("small");
  const endpoint::DatagramEndpoint endpoint(edge->server, {});
  tests::DatagramClient client(edge->server, "small");
  client.offer();
  ASSERT_TRUE(until(client, [&] { return client.datagramFrames.size() >= 5; }));
  const std::size_t byStream = client.streamFrames.size();
  // Frames leave in datagrams that the client does not read any more.
  std::this_thread::sleep_for(100ms);
  client.offer(false, std::string(32, 'x'));
  ASSERT_TRUE(until(client, [&] { return client.streamFrames.size() >= byStream + 3; }));
  EXPECT_EQ(headerIn(client.streamFrames[byStream]).kind, codec::PacketKind::key);
  EXPECT_EQ(edge->server.metrics.datagrams.peers, 0u);
}

// A scene is replaced at an edge while somebody joins it there.
TEST_F(EdgeParticipantsTest, ASessionAfterTheEndOfASceneHasOnlyTheLastMessage) {
  telemetry::NatsMetrics metrics;
  Nats nats(natsOptions(), metrics);
  EdgeTunnels tunnels(nats, 1, "stream");
  const auto last = delivery::error(v1::ERROR_CODE_CUT_OFF, "was replaced", true);
  tunnels.close(last);
  for (const char* resumeToken : {"", "known"}) {
    bool woken = false;
    const auto late = tunnels.connect(
        {.name = "peer", .address = "", .token = "", .resumeToken = resumeToken}, [&] { woken = true; });
    ASSERT_NE(late, nullptr);
    EXPECT_TRUE(woken);
    EXPECT_TRUE(late->send({}));
    EXPECT_EQ(late->next(), last);
    EXPECT_TRUE(late->ended());
  }
}

}  // namespace
}  // namespace clothstream::fleet
