// SPDX-License-Identifier: MIT
#include "tests/endpoint/viewer.h"

#include <algorithm>
#include <random>
#include <span>

#include <gtest/gtest.h>

namespace clothstream::tests {
namespace {

std::string serialised(const v1::ClientMessage& message) {
  return message.SerializeAsString();
}

codec::StreamLayout layoutOf(const v1::StreamDescription& description) {
  codec::StreamLayout layout;
  layout.epoch = description.epoch();
  layout.codec = static_cast<std::uint8_t>(description.codec());
  layout.maxError = description.max_error();
  layout.normals = description.normals() == v1::NORMALS_OCTAHEDRAL ? codec::NormalMode::octahedral
                                                                   : codec::NormalMode::none;
  layout.qualities = static_cast<std::uint8_t>(std::max(1u, description.qualities()));
  for (const v1::ClothDescription& cloth : description.cloths())
    layout.cloths.push_back({cloth.vertex_count(), cloth.rows(), cloth.columns()});
  return layout;
}

}  // namespace

std::string hello(const std::string& scene) {
  v1::ClientMessage message;
  message.mutable_hello()->set_protocol_version(1);
  for (const std::uint32_t codec : codec::kCodecs) message.mutable_hello()->add_codecs(codec);
  message.mutable_hello()->set_scene(scene);
  message.mutable_hello()->set_client_name("test");
  return serialised(message);
}

std::string ping(std::uint64_t clientTimeUs) {
  v1::ClientMessage message;
  message.mutable_ping()->set_client_time_us(clientTimeUs);
  return serialised(message);
}

std::string colliderPose(std::optional<float> x) {
  v1::ClientMessage message;
  v1::ColliderPoses& poses = *message.mutable_collider_poses();
  if (x) {
    v1::ParticipantCollider& collider = *poses.add_colliders();
    collider.set_id(1);
    collider.mutable_pose()->mutable_position()->set_x(*x);
    collider.mutable_pose()->mutable_orientation()->set_w(1);
    collider.mutable_sphere()->set_radius(0.2f);
  }
  return serialised(message);
}

std::string garbage(std::size_t bytes) {
  std::mt19937 random(7);
  std::string text(bytes, '\0');
  for (char& c : text) c = static_cast<char>(random());
  text.front() = '\x07';  // field 0 with wire type 7: no message starts like this
  return text;
}

std::optional<std::string> Viewer::receive(std::string_view message) {
  if (!last.ParseFromArray(message.data(), static_cast<int>(message.size()))) {
    ADD_FAILURE() << "not a ServerMessage: " << message.size() << " bytes";
    return std::nullopt;
  }
  switch (last.body_case()) {
    case v1::ServerMessage::kWelcome:
      welcome = last.welcome();
      break;
    case v1::ServerMessage::kChunk:
      receiveChunk(last.chunk());
      break;
    case v1::ServerMessage::kFrame:
      return receiveFrame(last.frame());
    case v1::ServerMessage::kPong:
      ++pongs;
      break;
    case v1::ServerMessage::kNotice:
      notices.push_back(last.notice());
      break;
    case v1::ServerMessage::kError:
      errors.push_back(last.error());
      break;
    default:
      break;
  }
  return std::nullopt;
}

void Viewer::receiveChunk(const v1::Chunk& chunk) {
  if (chunk.index() == 0) content_.clear();
  content_ += chunk.data();
  if (chunk.index() + 1 < chunk.count()) return;
  EXPECT_EQ(content_.size(), chunk.total_bytes());
  ASSERT_TRUE(description.ParseFromString(content_));
  decoder_ = codec::Decoder::make(layoutOf(description));
  ASSERT_NE(decoder_, nullptr);
}

std::string Viewer::receiveFrame(const v1::Frame& received) {
  v1::ClientMessage answer;
  if (!decoder_) {
    ADD_FAILURE() << "a frame before the description";
  } else if (decoder_->decode(std::as_bytes(std::span(received.packet()))) == codec::DecodeResult::ok) {
    frame = received;
    ++frames;
    EXPECT_EQ(decoder_->reconstructionHash(), received.reconstruction_hash())
        << "at tick " << decoder_->tick();
    answer.mutable_frame_ack()->set_tick(decoder_->tick());
  } else {
    answer.mutable_key_frame_request()->set_epoch(description.epoch());
  }
  return serialised(answer);
}

std::optional<v1::ColliderState> Viewer::colliderOf(std::uint64_t participant) const {
  for (const v1::ColliderState& collider : frame.colliders())
    if (collider.participant_id() == participant) return collider;
  return std::nullopt;
}

}  // namespace clothstream::tests
