// SPDX-License-Identifier: MIT
// Encodes waves on a grid and serialises them as messages.
#include "tests/core/scripted_server.h"

#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "proto/codec/vertex_normals.h"

namespace clothstream::client {
namespace {

std::string serialised(const v1::ServerMessage& message) {
  return message.SerializeAsString();
}

}  // namespace

ScriptedServer::ScriptedServer(ScriptedStream stream) : stream_(std::move(stream)) {
  layout_.epoch = stream_.epoch;
  layout_.normals = stream_.normals;
  layout_.codec = codec::kCodecHierarchical;
  for (const ClothSize& cloth : stream_.cloths)
    layout_.cloths.push_back({cloth.rows * cloth.columns, cloth.rows, cloth.columns});
  layout_.qualities = stream_.qualities;
  goTo(0);
  pose(0);
}

void ScriptedServer::goTo(std::uint8_t quality) {
  encoder_ = codec::Encoder::make(layout_, {.quality = quality});
  if (!encoder_) throw std::invalid_argument("this layout is not possible");
}

void ScriptedServer::pose(std::uint64_t tick) {
  positions_.clear();
  const float phase = static_cast<float>(tick) * 0.1f;
  for (std::size_t i = 0; i < stream_.cloths.size(); ++i) {
    for (std::uint32_t row = 0; row < stream_.cloths[i].rows; ++row) {
      for (std::uint32_t column = 0; column < stream_.cloths[i].columns; ++column) {
        const float x = 0.1f * static_cast<float>(column), y = -0.1f * static_cast<float>(row);
        positions_.insert(positions_.end(),
                          {x + 2 * static_cast<float>(i), y, 0.05f * std::sin(phase + 3 * x + 2 * y)});
      }
    }
  }
  normals_.resize(positions_.size());
  codec::computeVertexNormals(layout_, positions_.data(), normals_.data());
}

std::string ScriptedServer::welcome() const {
  v1::ServerMessage message;
  v1::Welcome& welcome = *message.mutable_welcome();
  welcome.set_protocol_version(CS_PROTOCOL_VERSION);
  welcome.set_codec(layout_.codec);
  welcome.set_scene("curtain");
  welcome.set_participant_id(42);
  welcome.set_server_name("scripted 1");
  welcome.set_device_name("none");
  welcome.set_description_content_id(1);
  return serialised(message);
}

v1::StreamDescription ScriptedServer::description() const {
  v1::StreamDescription description;
  description.set_epoch(stream_.epoch);
  description.set_codec(layout_.codec);
  description.set_scene("curtain");
  description.set_simulation_rate(stream_.simulationRate);
  description.set_stream_rate(stream_.streamRate);
  description.set_max_error(layout_.maxError);
  description.set_normals(stream_.normals == codec::NormalMode::none ? v1::NORMALS_NONE
                                                                     : v1::NORMALS_OCTAHEDRAL);
  description.set_qualities(stream_.qualities);
  std::size_t first = 0;
  for (const ClothSize& size : stream_.cloths) {
    v1::ClothDescription& cloth = *description.add_cloths();
    cloth.set_name(size.name);
    cloth.set_vertex_count(size.rows * size.columns);
    cloth.set_rows(size.rows);
    cloth.set_columns(size.columns);
    std::string rest(std::size_t{size.rows} * size.columns * 12, '\0');
    std::memcpy(rest.data(), positions_.data() + first, rest.size());
    cloth.set_rest_positions(std::move(rest));
    first += std::size_t{size.rows} * size.columns * 3;
    v1::Cloth& definition = *description.mutable_definition()->add_cloths();
    definition.set_name(size.name);
    definition.mutable_structural()->set_stiffness(100);
    definition.mutable_structural()->set_damping(0.5f);
    definition.set_damping(0.25f);
  }
  v1::ColliderState& ball = *description.add_colliders();
  ball.set_name("ball");
  ball.mutable_position()->set_y(1);
  ball.mutable_sphere()->set_radius(0.25f);
  v1::ColliderState& stone = *description.add_colliders();
  stone.set_name("stone");
  for (const float corner : {0.0f, 1.0f, 2.0f, 3.0f}) stone.mutable_hull()->add_vertices()->set_x(corner);
  for (const auto& face : {std::array{0u, 1u, 2u, 3u}, {3u, 2u, 1u, 0u}})
    stone.mutable_hull()->add_faces()->mutable_vertices()->Assign(face.begin(), face.end());
  description.mutable_definition()->mutable_environment()->mutable_wind()->set_x(3);
  return description;
}

std::vector<std::string> chunksOf(const std::string& content, std::size_t pieceBytes,
                                  std::uint64_t contentId) {
  const std::size_t count = (content.size() + pieceBytes - 1) / pieceBytes;
  std::vector<std::string> messages;
  for (std::size_t i = 0; i < count; ++i) {
    v1::ServerMessage message;
    v1::Chunk& chunk = *message.mutable_chunk();
    chunk.set_content_id(contentId);
    chunk.set_kind(v1::CONTENT_KIND_STREAM_DESCRIPTION);
    chunk.set_index(static_cast<std::uint32_t>(i));
    chunk.set_count(static_cast<std::uint32_t>(count));
    chunk.set_total_bytes(content.size());
    chunk.set_data(content.substr(i * pieceBytes, pieceBytes));
    messages.push_back(serialised(message));
  }
  return messages;
}

std::vector<std::string> ScriptedServer::chunks(std::size_t pieceBytes, std::uint64_t contentId) const {
  return chunksOf(description().SerializeAsString(), pieceBytes, contentId);
}

v1::Frame ScriptedServer::frameMessage(std::uint64_t tick, codec::PacketKind kind) {
  pose(tick);
  std::vector<std::byte> packet(encoder_->packetBound());
  const bool sendsNormals = stream_.normals != codec::NormalMode::none;
  const std::size_t bytes =
      encoder_->encode(tick, kind, positions_,
                       sendsNormals ? std::span<const float>(normals_) : std::span<const float>(), packet);
  v1::Frame frame;
  frame.set_packet(packet.data(), bytes);
  frame.set_reconstruction_hash(encoder_->reconstructionHash());
  v1::ColliderState& ball = *frame.add_colliders();
  ball.set_name("ball");
  ball.mutable_position()->set_x(static_cast<float>(tick));
  ball.mutable_sphere()->set_radius(0.25f);
  frame.add_colliders()->set_name("stone");
  v1::ColliderState& finger = *frame.add_colliders();
  finger.set_participant_id(7);
  const double turn = 0.05 * static_cast<double>(tick);
  finger.mutable_position()->set_y(0.02f * static_cast<float>(tick));
  finger.mutable_orientation()->set_z(static_cast<float>(std::sin(turn)));
  finger.mutable_orientation()->set_w(static_cast<float>(std::cos(turn)));
  finger.mutable_capsule()->set_radius(0.01f);
  finger.mutable_capsule()->set_length(0.03f);
  frame.add_colliders()->mutable_plane();
  frame.add_colliders()->mutable_box()->mutable_size()->set_y(2);
  return frame;
}

std::string ScriptedServer::frame(std::uint64_t tick, codec::PacketKind kind) {
  return serialise(frameMessage(tick, kind));
}

std::string ScriptedServer::serialise(const v1::Frame& frame) {
  v1::ServerMessage message;
  *message.mutable_frame() = frame;
  return serialised(message);
}

std::string ScriptedServer::operatingPoint(std::uint32_t quality) {
  v1::ServerMessage message;
  message.mutable_operating_point()->set_quality(quality);
  return serialised(message);
}

std::string ScriptedServer::pong(std::uint64_t clientTimeUs, std::uint64_t serverTimeUs) {
  v1::ServerMessage message;
  message.mutable_pong()->set_client_time_us(clientTimeUs);
  message.mutable_pong()->set_server_time_us(serverTimeUs);
  return serialised(message);
}

std::string ScriptedServer::error(v1::ErrorCode code, const std::string& text, bool fatal,
                                  const std::string& server) {
  v1::ServerMessage message;
  message.mutable_error()->set_code(code);
  message.mutable_error()->set_text(text);
  message.mutable_error()->set_fatal(fatal);
  message.mutable_error()->set_server(server);
  return serialised(message);
}

cs_client_options optionsFor(const char* scene) {
  return {.role = CS_ROLE_UNSPECIFIED, .scene = scene, .client_name = "test", .display_name = ""};
}

cs_own_collider sphereAt(float x, float y, float z, float radius) {
  return {.shape = CS_SHAPE_SPHERE,
          .position = {x, y, z},
          .orientation = {},
          .radius = radius,
          .length = 0,
          .size = {},
          .top_radius = 0};
}

ClientUnderTest::ClientUnderTest(const char* scene) : client_(nullptr, &cs_destroy) {
  const cs_client_options options = optionsFor(scene);
  client_.reset(cs_create(&options));
}

std::uint32_t ClientUnderTest::receive(const std::string& message, std::uint64_t nowUs) {
  const auto exact = std::make_unique<std::uint8_t[]>(message.size());
  std::memcpy(exact.get(), message.data(), message.size());
  return cs_receive(get(), exact.get(), message.size(), nowUs);
}

void ClientUnderTest::receiveAll(const std::vector<std::string>& messages, std::uint64_t nowUs) {
  for (const std::string& message : messages) receive(message, nowUs);
}

void ClientUnderTest::join(const ScriptedServer& server) {
  receive(server.welcome());
  receiveAll(server.chunks());
  outgoing();
}

std::vector<v1::ClientMessage> ClientUnderTest::outgoing() {
  std::vector<v1::ClientMessage> messages;
  std::size_t bytes = 0;
  while (const std::uint8_t* message = cs_next_outgoing(get(), &bytes)) {
    if (!messages.emplace_back().ParseFromArray(message, static_cast<int>(bytes)))
      throw std::runtime_error("the client sent a malformed ClientMessage");
  }
  return messages;
}

cs_statistics ClientUnderTest::statistics(std::uint64_t nowUs) const {
  cs_statistics statistics;
  cs_get_statistics(get(), nowUs, &statistics);
  return statistics;
}

}  // namespace clothstream::client
