// SPDX-License-Identifier: MIT
// Client with play-out, for tests of what it shows.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "clients/core/core.h"
#include "proto/codec/encoder.h"
#include "tests/core/scripted_server.h"

namespace clothstream::client {

inline constexpr std::uint64_t kServerAhead = 5'000'000'000;  // us; server's clock minus own clock
inline constexpr std::uint64_t kFrameUs = 10 * kMs;

inline cs_play_out_options defaultPlayOut() {
  cs_play_out_options options;
  cs_default_play_out(&options);
  return options;
}

inline cs_play_out_options chosenDelay(double ms) {
  cs_play_out_options options = defaultPlayOut();
  options.delay_ms = ms;
  return options;
}

using Floats = std::vector<float>;

// Client with play-out. It knows the server's clock exactly. Frames come every 10 ms. Times are of the own
// clock.
class Viewer {
 public:
  explicit Viewer(const cs_play_out_options& options = defaultPlayOut(), ScriptedStream stream = {})
      : server(hundredHertz(std::move(stream))) {
    EXPECT_EQ(cs_set_play_out(client.get(), &options), 1);
    client.join(server);
  }

  static ScriptedStream hundredHertz(ScriptedStream stream) {
    stream.simulationRate = stream.streamRate = 100;
    return stream;
  }

  // Simulates one ping with a round trip of zero.
  void learnClock(std::uint64_t nowUs = 1) {
    cs_update(client.get(), nowUs);
    client.outgoing();
    client.receive(ScriptedServer::pong(nowUs, nowUs + kServerAhead), nowUs);
  }

  // Frame of a tick that started at tickUs.
  std::string frame(std::uint64_t tick, std::uint64_t tickUs,
                    codec::PacketKind kind = codec::PacketKind::predicted) {
    v1::Frame frame = server.frameMessage(tick, kind);
    frame.set_tick_time_us(tickUs + kServerAhead);
    frame.set_packet_time_us(tickUs + kServerAhead + 4 * kMs);
    return ScriptedServer::serialise(frame);
  }
  void receive(std::uint64_t tick, std::uint64_t tickUs, std::uint64_t nowUs,
               codec::PacketKind kind = codec::PacketKind::predicted) {
    ASSERT_EQ(client.receive(frame(tick, tickUs, kind), nowUs), static_cast<std::uint32_t>(CS_EVENT_FRAME));
  }

  cs_played play(std::uint64_t nowUs) { return play(nowUs, nowUs); }
  cs_played play(std::uint64_t nowUs, std::uint64_t displayUs) {
    cs_played played{};
    EXPECT_EQ(cs_play_out(client.get(), nowUs, displayUs, &played), 1);
    return played;
  }

  Floats copied(const float* values) const { return {values, values + 3 * cs_vertex_count(client.get())}; }
  Floats positions() const { return copied(cs_positions(client.get())); }
  Floats normals() const { return copied(cs_normals(client.get())); }
  Floats playedPositions() const { return copied(cs_played_positions(client.get())); }
  Floats playedNormals() const { return copied(cs_played_normals(client.get())); }
  // First collider of this participant; 0 means the scene.
  cs_collider playedCollider(std::uint64_t participant) const {
    return colliderOf(participant, &cs_get_played_collider);
  }
  cs_collider newestCollider(std::uint64_t participant) const {
    return colliderOf(participant, &cs_get_collider);
  }
  cs_collider colliderOf(std::uint64_t participant,
                         int (*get)(const cs_client*, std::uint32_t, cs_collider*)) const {
    cs_collider collider{};
    std::uint32_t index = 0;
    while (get(client.get(), index, &collider) != 0 && collider.participant_id != participant) ++index;
    EXPECT_EQ(get(client.get(), index, &collider), 1);
    return collider;
  }
  cs_stage_statistics stages() const {
    cs_stage_statistics stages{};
    EXPECT_EQ(cs_get_stage_statistics(client.get(), &stages), 1);
    return stages;
  }

  ScriptedServer server;
  ClientUnderTest client;
};

// Compares bit for bit, so NaN equals NaN, and 0 differs from -0.
inline bool sameBits(const Floats& a, const Floats& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

}  // namespace clothstream::client
