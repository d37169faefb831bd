// SPDX-License-Identifier: MIT
// A mirror shows what its client shows, and sends only what the program asks for.
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/core/play_out_viewer.h"
#include "tests/core/scripted_server.h"
#include "tests/core/sessions.h"

namespace clothstream::client {
namespace {

using ::testing::SizeIs;

// A client and its mirror.
class Pair {
 public:
  explicit Pair(bool forwards = true) : forwards_(forwards) {}

  cs_client* mirror() const { return mirror_.get(); }

  std::uint32_t receive(const std::string& message, std::uint64_t nowUs = 0) {
    const std::uint64_t errors = client.statistics().decode_errors;
    events = client.receive(message, nowUs);
    const bool isFrame = (events & CS_EVENT_FRAME) != 0;
    cs_decoded decoded = lastDecoded();
    decoded.decoding = isFrame && forwards_                         ? CS_DECODING_DONE
                       : client.statistics().decode_errors > errors ? CS_DECODING_REFUSED
                                                                    : CS_DECODING_SKIPPED;
    return pass(message, &decoded, nowUs);
  }
  std::uint32_t pass(const std::string& message, const cs_decoded* decoded, std::uint64_t nowUs = 0) {
    const std::vector<std::uint8_t> bytes(message.begin(), message.end());
    return cs_receive_decoded(mirror(), bytes.data(), bytes.size(), decoded, nowUs);
  }
  cs_decoded lastDecoded() const {
    return {.version = CS_DECODED_VERSION,
            .decoding = CS_DECODING_DONE,
            .positions = cs_positions(client.get()),
            .normals = cs_normals(client.get()),
            .vertex_count = cs_vertex_count(client.get()),
            .reconstruction_hash = cs_reconstruction_hash(client.get()),
            .decode_ms = 1.5};
  }
  void join(const ScriptedServer& server) {
    receive(server.welcome());
    for (const std::string& chunk : server.chunks()) receive(chunk);
  }
  std::vector<v1::ClientMessage> sentByMirror() {
    std::vector<v1::ClientMessage> messages;
    std::size_t bytes = 0;
    while (const std::uint8_t* message = cs_next_outgoing(mirror(), &bytes))
      messages.emplace_back().ParseFromArray(message, static_cast<int>(bytes));
    return messages;
  }

  ClientUnderTest client;
  std::uint32_t events = 0;  // of the client, at the last message

 private:
  bool forwards_;
  const cs_client_options options_ = optionsFor("curtain");
  std::unique_ptr<cs_client, decltype(&cs_destroy)> mirror_{cs_create_mirror(&options_), &cs_destroy};
};

// Regular streams, and hundreds of sessions with corrupted bytes.
TEST(Mirror, ObservesWhatItsClientObserves) {
  std::size_t frames = 0, refused = 0;
  for (const Session& session : recordedSessions()) {
    SCOPED_TRACE(session.name);
    Pair pair;
    playOutForReplay(pair.client.get());
    playOutForReplay(pair.mirror());
    for (std::size_t i = 0; i < session.messages.size(); ++i) {
      const std::uint64_t now = i * kStepUs;
      const std::uint32_t seen = pair.receive(session.messages[i], now);
      ASSERT_EQ(seen, pair.events) << i;
      for (cs_client* client : {pair.client.get(), pair.mirror()}) {
        cs_update(client, now);
        cs_play_out(client, now, now, nullptr);
      }
      Observation expected = observe(pair.client.get(), pair.events), mirrored = observe(pair.mirror(), seen);
      expected.outgoingHash = mirrored.outgoingHash = 0;
      ASSERT_EQ(expected, mirrored) << i;
      frames += (seen & CS_EVENT_FRAME) != 0 ? 1 : 0;
    }
    refused += pair.client.statistics().decode_errors;
  }
  EXPECT_GT(frames, 1000u);
  EXPECT_GT(refused, 10u);
}

TEST(Mirror, SendsOnlyRequestsOfTheProgram) {
  ScriptedServer server;
  Pair pair;
  EXPECT_THAT(pair.sentByMirror(), SizeIs(0));
  pair.join(server);
  pair.receive(server.frame(1, codec::PacketKind::key), 20'000);
  // A frame that was lost: the client asks for a key frame.
  server.frame(2);
  pair.receive(server.frame(3), 40'000);
  cs_update(pair.mirror(), 1'000'000);
  EXPECT_THAT(pair.sentByMirror(), SizeIs(0));
  EXPECT_GT(pair.client.outgoing().size(), 1u);

  const cs_own_collider ball = sphereAt(0, 1, 0, 0.1f);
  cs_set_colliders(pair.mirror(), &ball, 1, 1'000'000);
  cs_list_scenes(pair.mirror());
  const auto sent = pair.sentByMirror();
  ASSERT_THAT(sent, SizeIs(2));
  // Ids of the client itself are small.
  EXPECT_GE(sent[0].request_id(), 1u << 31);
  EXPECT_TRUE(sent[0].has_list_scenes());
  EXPECT_TRUE(sent[1].has_collider_poses());
}

TEST(Mirror, LearnsTheClockFromThePongsOfItsClient) {
  ScriptedServer server;
  Pair pair;
  pair.join(server);
  cs_update(pair.client.get(), 1'000'000);
  pair.receive(ScriptedServer::pong(1'000'000, 1'001'000 + kServerAhead), 1'002'000);
  cs_statistics statistics;
  cs_get_statistics(pair.mirror(), 1'002'000, &statistics);
  EXPECT_EQ(statistics.round_trip_ms, 2);
  EXPECT_EQ(statistics.clock_offset_us, static_cast<double>(kServerAhead));
}

TEST(Mirror, KeepsPosesOverALostConnection) {
  ScriptedServer server;
  Pair pair;
  pair.join(server);
  const cs_own_collider ball = sphereAt(0, 1, 0, 0.1f);
  cs_set_colliders(pair.mirror(), &ball, 1, 1'000'000);
  EXPECT_THAT(pair.sentByMirror(), SizeIs(1));
  cs_disconnected(pair.mirror(), 2'000'000);
  cs_connecting(pair.mirror(), 2'100'000);
  EXPECT_THAT(pair.sentByMirror(), SizeIs(0));
}

TEST(Mirror, SkipsFramesThatItsClientDoesNotPassOn) {
  ScriptedServer server;
  Pair pair(false);
  pair.join(server);
  const std::string frame = server.frame(1, codec::PacketKind::key);
  EXPECT_EQ(pair.receive(frame), 0u);
  EXPECT_EQ(pair.pass(frame, nullptr), 0u);
  cs_decoded decoded = pair.lastDecoded();
  decoded.version = CS_DECODED_VERSION + 1;
  EXPECT_EQ(pair.pass(frame, &decoded), 0u);
  decoded = pair.lastDecoded();
  --decoded.vertex_count;
  EXPECT_EQ(pair.pass(frame, &decoded), 0u);
  decoded = pair.lastDecoded();
  decoded.positions = nullptr;
  EXPECT_EQ(pair.pass(frame, &decoded), 0u);
  decoded = pair.lastDecoded();
  EXPECT_EQ(pair.pass(frame, &decoded), std::uint32_t{CS_EVENT_FRAME});
  cs_stage_statistics stages{};
  EXPECT_EQ(cs_get_stage_statistics(pair.mirror(), &stages), 1);
  EXPECT_EQ(stages.decode_ms, 1.5);
}

}  // namespace
}  // namespace clothstream::client
