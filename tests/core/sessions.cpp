// SPDX-License-Identifier: MIT
// Creates sessions from the scripted server, the golden packets, and a random generator with a fixed seed.
#include "tests/core/sessions.h"

#include <random>
#include <span>
#include <stdexcept>

#include "tests/codec/golden.h"

namespace clothstream::client {
namespace {

constexpr std::uint64_t kServerAheadUs = 60'000'000, kTickUs = 13'889;

Session streamOf(const std::string& name, ScriptedStream stream) {
  ScriptedServer server(std::move(stream));
  Session session{name, {server.welcome()}};
  for (std::string& chunk : server.chunks(400)) session.messages.push_back(std::move(chunk));
  // Answers the ping that was sent at the previous message.
  const std::uint64_t pingUs = (session.messages.size() - 1) * kStepUs;
  session.messages.push_back(ScriptedServer::pong(pingUs, pingUs + kServerAheadUs));
  for (std::uint64_t tick = 1; tick <= 12; ++tick) {
    // One frame is lost. A key frame follows two frames later.
    const auto kind = tick == 8 ? codec::PacketKind::key : codec::PacketKind::predicted;
    v1::Frame frame = server.frameMessage(tick, kind);
    frame.set_tick_time_us(pingUs + kServerAheadUs + tick * kTickUs);
    if (tick != 6) session.messages.push_back(ScriptedServer::serialise(frame));
  }
  session.messages.push_back(
      ScriptedServer::error(v1::ERROR_CODE_INVALID_ARGUMENT, "wind: 1e9 is too much", false));
  return session;
}

Session corrupted(const Session& session, std::mt19937& random, int run) {
  const auto below = [&](std::size_t bound) { return random() % bound; };
  Session result{session.name + " corrupted " + std::to_string(run), session.messages};
  std::string& message = result.messages[below(result.messages.size())];
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    if (below(4) == 0) message.resize(below(message.size() + 1));
    if (message.empty()) break;
    message[below(message.size())] = static_cast<char>(below(256));
  }
  return result;
}

std::uint64_t hashOf(const float* values, std::uint32_t vertices) {
  return vertices == 0 ? 0 : codec::hashFloats(std::span(values, std::size_t{3} * vertices));
}

std::uint64_t hashOfPlayedColliders(cs_client* client) {
  std::vector<float> poses;
  cs_collider collider;
  for (std::uint32_t i = 0; cs_get_played_collider(client, i, &collider) != 0; ++i) {
    poses.insert(poses.end(), std::begin(collider.position), std::end(collider.position));
    poses.insert(poses.end(), std::begin(collider.orientation), std::end(collider.orientation));
  }
  return codec::hashFloats(poses);
}

std::uint64_t hashOfOutgoing(cs_client* client) {
  std::uint64_t hash = 0xcbf29ce484222325;
  std::size_t bytes = 0;
  while (const std::uint8_t* message = cs_next_outgoing(client, &bytes)) {
    for (const std::uint8_t byte : std::span(message, bytes)) hash = (hash ^ byte) * 0x100000001b3;
  }
  return hash;
}

}  // namespace

Observation observe(cs_client* client, std::uint32_t events) {
  cs_statistics statistics;
  cs_get_statistics(client, 0, &statistics);
  const std::uint32_t vertices = cs_vertex_count(client);
  std::uint32_t indices = 0;
  cs_triangles(client, &indices);
  return {.events = events,
          .state = cs_get_state(client),
          .tick = statistics.tick,
          .decodeErrors = statistics.decode_errors,
          .hashMismatches = statistics.hash_mismatches,
          .reconstructionHash = cs_reconstruction_hash(client),
          .positionsHash = hashOf(cs_positions(client), vertices),
          .normalsHash = hashOf(cs_normals(client), vertices),
          .playedPositionsHash = hashOf(cs_played_positions(client), vertices),
          .playedNormalsHash = hashOf(cs_played_normals(client), vertices),
          .playedCollidersHash = hashOfPlayedColliders(client),
          .triangleCount = indices / 3,
          .outgoingHash = hashOfOutgoing(client),
          .errorText = cs_error_text(client)};
}

Session goldenSession(const std::string& name) {
  for (const codec::GoldenStream& stream : codec::readGoldenStreams()) {
    if (stream.name != name) continue;
    v1::StreamDescription description;
    description.set_epoch(stream.layout.epoch);
    description.set_codec(stream.layout.codec);
    description.set_simulation_rate(72);
    description.set_stream_rate(72);
    description.set_max_error(stream.layout.maxError);
    description.set_qualities(stream.layout.qualities);
    const auto& [x, y, z] = stream.layout.origin;
    description.mutable_origin()->set_x(x);
    description.mutable_origin()->set_y(y);
    description.mutable_origin()->set_z(z);
    description.set_normals(stream.layout.normals == codec::NormalMode::none ? v1::NORMALS_NONE
                                                                             : v1::NORMALS_OCTAHEDRAL);
    for (const codec::ClothLayout& layout : stream.layout.cloths) {
      v1::ClothDescription& cloth = *description.add_cloths();
      cloth.set_vertex_count(layout.vertexCount);
      cloth.set_rows(layout.rows);
      cloth.set_columns(layout.columns);
      const bool known = !layout.restPositions.empty();
      cloth.set_rest_positions(littleEndian(known ? layout.restPositions
                                                  : std::vector<float>(3 * std::size_t{layout.vertexCount})));
      cloth.set_triangles(littleEndian(layout.triangles));
    }
    Session session{"golden " + name, {ScriptedServer().welcome()}};
    for (std::string& chunk : chunksOf(description.SerializeAsString(), 256 * 1024, 1))
      session.messages.push_back(std::move(chunk));
    for (const codec::GoldenPacket& packet : stream.packets) {
      v1::Frame frame;
      frame.set_packet(packet.bytes.data(), packet.bytes.size());
      frame.set_reconstruction_hash(packet.reconstructionHash);
      session.messages.push_back(ScriptedServer::serialise(frame));
    }
    for (const codec::GoldenRefusal& refused : stream.refused) {
      v1::Frame frame;
      frame.set_packet(refused.bytes.data(), refused.bytes.size());
      session.messages.push_back(ScriptedServer::serialise(frame));
    }
    return session;
  }
  throw std::invalid_argument("tests/golden has no stream " + name);
}

std::vector<Session> recordedSessions() {
  std::vector<Session> sessions{
      streamOf("one cloth", {}),
      streamOf("two cloths with normals",
               {.normals = codec::NormalMode::octahedral, .cloths = {{"a", 4, 3}, {"b", 17, 2}}}),
      streamOf("a frame every third tick", {.simulationRate = 240, .streamRate = 80}),
  };
  for (const codec::GoldenStream& stream : codec::readGoldenStreams())
    sessions.push_back(goldenSession(stream.name));
  std::mt19937 random(20);
  const std::size_t whole = sessions.size();
  for (int run = 0; run < 300; ++run)
    sessions.push_back(corrupted(sessions[static_cast<std::size_t>(run) % whole], random, run));
  return sessions;
}

void playOutForReplay(cs_client* client) {
  cs_play_out_options options;
  cs_default_play_out(&options);
  options.delay_ms = kPlayOutDelayMs;
  cs_set_play_out(client, &options);
}

std::vector<Observation> replay(const Session& session) {
  std::vector<Observation> observations;
  ClientUnderTest client;
  playOutForReplay(client.get());
  for (std::size_t i = 0; i < session.messages.size(); ++i) {
    const std::uint32_t events = client.receive(session.messages[i], i * kStepUs);
    cs_update(client.get(), i * kStepUs);
    cs_play_out(client.get(), i * kStepUs, i * kStepUs, nullptr);
    observations.push_back(observe(client.get(), events));
  }
  return observations;
}

}  // namespace clothstream::client
