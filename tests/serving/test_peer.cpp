// SPDX-License-Identifier: MIT
// Reads messages, assembles the description and decodes frames.
#include "tests/serving/test_peer.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <gtest/gtest.h>

#include "proto/codec/packet_header.h"

namespace clothstream::tests {

TestPeer::TestPeer(hosting::SceneServer& server, session::Arrival arrival)
    : session_(session::Session::open(server, std::move(arrival), [this] {
        const std::lock_guard lock(mutex_);
        awake_ = true;
        woken_.notify_all();
      })) {}

void TestPeer::send(const v1::ClientMessage& message) {
  sendBytes(message.SerializeAsString());
}

void TestPeer::sendBytes(const std::string& bytes) {
  session_->receive(std::as_bytes(std::span(bytes)));
}

void TestPeer::hello(const std::string& scene) {
  v1::Hello hello;
  hello.set_scene(scene);
  hello.set_role(role);
  this->hello(hello);
}

void TestPeer::hello(const v1::Hello& hello) {
  v1::ClientMessage message;
  message.set_request_id(1);
  *message.mutable_hello() = hello;
  message.mutable_hello()->set_protocol_version(1);
  for (const std::uint32_t codec : codec::kCodecs) message.mutable_hello()->add_codecs(codec);
  message.mutable_hello()->set_client_name("test");
  send(message);
}

void TestPeer::poses(const std::vector<std::pair<std::uint32_t, float>>& idsAndXs) {
  v1::ClientMessage message;
  message.mutable_collider_poses();
  for (const auto& [id, x] : idsAndXs) {
    v1::ParticipantCollider& collider = *message.mutable_collider_poses()->add_colliders();
    collider.set_id(id);
    collider.mutable_pose()->mutable_position()->set_x(x);
    collider.mutable_sphere()->set_radius(0.1f);
  }
  send(message);
}

void TestPeer::change(const v1::ParameterChange& change) {
  v1::ClientMessage message;
  message.set_request_id(77);
  *message.mutable_parameter_change() = change;
  send(message);
}

void TestPeer::join(const std::string& scene) {
  hello(scene);
  readFrames(1);
}

std::optional<v1::ServerMessage> TestPeer::read() {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  for (;;) {
    const bool finished = session_->finished();  // before next(), because earlier messages must still be read
    if (const std::optional<delivery::SharedBytes> bytes = session_->next()) {
      v1::ServerMessage message;
      if (!message.ParseFromArray((*bytes)->data(), static_cast<int>((*bytes)->size())))
        throw std::runtime_error("the bytes are not a ServerMessage");
      see(message, *bytes);
      return message;
    }
    if (finished) return std::nullopt;
    std::unique_lock lock(mutex_);
    if (!woken_.wait_until(lock, deadline, [&] { return std::exchange(awake_, false); }))
      throw std::runtime_error("nothing came for a long time");
  }
}

v1::ServerMessage TestPeer::readUntil(const std::function<bool(const v1::ServerMessage&)>& wanted) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < deadline) {
    std::optional<v1::ServerMessage> message = read();
    if (!message) throw std::runtime_error("the connection was finished before what was waited for came");
    if (wanted(*message)) return *message;
  }
  throw std::runtime_error("what was waited for never came");
}

v1::ServerMessage TestPeer::readUntil(v1::ServerMessage::BodyCase body) {
  return readUntil([&](const v1::ServerMessage& message) { return message.body_case() == body; });
}

void TestPeer::readFrames(std::size_t count) {
  const std::size_t wanted = frames_.size() + count;
  readUntil([&](const v1::ServerMessage&) { return frames_.size() >= wanted; });
}

v1::ServerMessage TestPeer::readToTheEnd() {
  v1::ServerMessage last;
  while (std::optional<v1::ServerMessage> message = read()) last = std::move(*message);
  return last;
}

void TestPeer::see(const v1::ServerMessage& message, const delivery::SharedBytes& bytes) {
  if (message.has_welcome()) welcome_ = message.welcome();
  if (message.has_chunk()) seeChunk(message.chunk());
  if (message.has_frame()) seeFrame(message.frame(), bytes);
}

namespace {

template <typename Number>
std::vector<Number> numbersOf(const std::string& bytes) {
  std::vector<Number> numbers(bytes.size() / sizeof(Number));
  if (!numbers.empty()) std::memcpy(numbers.data(), bytes.data(), numbers.size() * sizeof(Number));
  return numbers;
}

}  // namespace

void TestPeer::seeChunk(const v1::Chunk& chunk) {
  EXPECT_EQ(chunk.content_id(), welcome_.description_content_id());
  EXPECT_EQ(chunk.kind(), v1::CONTENT_KIND_STREAM_DESCRIPTION);
  content_ += chunk.data();
  if (chunk.index() + 1 < chunk.count()) return;
  EXPECT_EQ(content_.size(), chunk.total_bytes());
  ASSERT_TRUE(description_.ParseFromString(content_));
  const bool octahedral = description_.normals() == v1::NORMALS_OCTAHEDRAL;
  codec::StreamLayout layout;
  layout.epoch = description_.epoch();
  layout.codec = static_cast<std::uint8_t>(description_.codec());
  layout.maxError = description_.max_error();
  layout.normals = octahedral ? codec::NormalMode::octahedral : codec::NormalMode::none;
  layout.qualities = static_cast<std::uint8_t>(std::max(1u, description_.qualities()));
  for (const v1::ClothDescription& cloth : description_.cloths())
    layout.cloths.push_back(
        {cloth.vertex_count(), cloth.rows(), cloth.columns(), numbersOf<std::uint32_t>(cloth.triangles()),
         cloth.triangles().empty() ? std::vector<float>{} : numbersOf<float>(cloth.rest_positions())});
  decoder_ = codec::Decoder::make(layout);
  ASSERT_TRUE(decoder_);
}

void TestPeer::seeFrame(const v1::Frame& frame, const delivery::SharedBytes& bytes) {
  ASSERT_TRUE(decoder_) << "a frame came before its description";
  const auto packet = std::as_bytes(std::span(frame.packet()));
  // Every frame can be decoded, whichever frames were dropped, and has the hash that the server sent.
  ASSERT_EQ(decoder_->decode(packet), codec::DecodeResult::ok);
  ASSERT_EQ(decoder_->reconstructionHash(), frame.reconstruction_hash());
  EXPECT_LE(frame.tick_time_us(), frame.packet_time_us());
  const codec::PacketHeader header = codec::parsePacket(packet)->header;
  frames_.push_back({.tick = decoder_->tick(),
                     .key = header.kind == codec::PacketKind::key,
                     .quality = header.quality,
                     .stateHash = frame.state_hash(),
                     .message = bytes,
                     .colliders = {frame.colliders().begin(), frame.colliders().end()}});
  if (!acknowledges) return;
  v1::ClientMessage ack;
  ack.mutable_frame_ack()->set_tick(decoder_->tick());
  send(ack);
}

}  // namespace clothstream::tests
