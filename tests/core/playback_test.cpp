// SPDX-License-Identifier: MIT
// State of a played recording, and requests that control it.
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/scripted_server.h"

namespace clothstream::client {
namespace {

std::string playbackAt(double position, double speed, bool paused, double length = 10) {
  v1::ServerMessage message;
  v1::Playback& playback = *message.mutable_playback();
  playback.set_length(length);
  playback.set_position(position);
  playback.set_speed(speed);
  playback.set_loop(true);
  playback.set_paused(paused);
  return message.SerializeAsString();
}

double positionAt(const ClientUnderTest& client, std::uint64_t nowUs) {
  cs_playback playback{};
  return cs_get_playback(client.get(), nowUs, &playback) != 0 ? playback.position : -1;
}

TEST(Playback, AdvancesBetweenMessages) {
  ScriptedServer server;
  ClientUnderTest client;
  client.join(server);
  EXPECT_EQ(positionAt(client, 1'000'000), -1);
  EXPECT_EQ(client.receive(playbackAt(2, 0.5, false), 1'000'000),
            static_cast<std::uint32_t>(CS_EVENT_PLAYBACK));
  EXPECT_DOUBLE_EQ(positionAt(client, 1'000'000), 2);
  EXPECT_DOUBLE_EQ(positionAt(client, 3'000'000), 3);
  EXPECT_DOUBLE_EQ(positionAt(client, 900'000), 2);
  EXPECT_DOUBLE_EQ(positionAt(client, 100'000'000), 10);
  cs_playback playback{};
  ASSERT_EQ(cs_get_playback(client.get(), 1'000'000, &playback), 1);
  EXPECT_EQ(playback.length, 10);
  EXPECT_EQ(playback.speed, 0.5);
  EXPECT_EQ(playback.loop, 1);
  EXPECT_EQ(playback.paused, 0);

  client.receive(playbackAt(4, 1, true), 5'000'000);
  EXPECT_DOUBLE_EQ(positionAt(client, 9'000'000), 4);
}

TEST(Playback, RefusesNonFiniteNumbers) {
  for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), -1.0}) {
    ScriptedServer server;
    ClientUnderTest client;
    client.join(server);
    client.receive(playbackAt(0, 1, false, wrong));
    EXPECT_EQ(cs_get_state(client.get()), CS_STATE_FAILED);
  }
}

TEST(Playback, ControlsTheJoinedScene) {
  ScriptedServer server;
  ClientUnderTest client("");
  cs_seek(client.get(), 1);  // ignored before joining
  client.join(server);
  client.outgoing();
  cs_pause(client.get(), 1);
  cs_seek(client.get(), 2.5);
  cs_set_speed(client.get(), 0.25);
  cs_set_loop(client.get(), 0);
  const std::vector<v1::ClientMessage> sent = client.outgoing();
  ASSERT_EQ(sent.size(), 4u);
  for (const v1::ClientMessage& message : sent) {
    ASSERT_TRUE(message.has_control_scene());
    EXPECT_EQ(message.control_scene().name(), "curtain");
    EXPECT_NE(message.request_id(), 0u);
  }
  EXPECT_TRUE(sent[0].control_scene().paused());
  EXPECT_FALSE(sent[0].control_scene().has_seek());
  EXPECT_EQ(sent[1].control_scene().seek(), 2.5);
  EXPECT_FALSE(sent[1].control_scene().has_paused());
  EXPECT_EQ(sent[2].control_scene().speed(), 0.25);
  EXPECT_TRUE(sent[3].control_scene().has_loop());
  EXPECT_FALSE(sent[3].control_scene().loop());
}

}  // namespace
}  // namespace clothstream::client
