// SPDX-License-Identifier: MIT
#include "clients/load/hostile_client.h"

#include <limits>
#include <utility>

#include "clients/core/core.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::load {
namespace {

enum Kind : std::size_t { kRandomBytes, kNotFinite, kHuge, kNeverReads, kLeavesAtOnce, kKinds };

constexpr std::chrono::milliseconds kPause{50};
// Time after which the client disconnects if the server has not ended the connection.
constexpr std::chrono::seconds kPatience{3};
constexpr std::size_t kHugeBytes = 1 << 20;
constexpr int kRequestsAStep = 100;

}  // namespace

HostileClient::HostileClient(Links& links, std::string scene, std::size_t first, std::string token)
    : links_(links), scene_(std::move(scene)), token_(std::move(token)), kind_(first % kKinds) {}

HostileClient::~HostileClient() {
  drop();
}

void HostileClient::drop() {
  if (link_) link_->drop();
  link_.reset();
}

std::string HostileClient::hello() const {
  v1::ClientMessage message;
  v1::Hello& hello = *message.mutable_hello();
  hello.set_protocol_version(CS_PROTOCOL_VERSION);
  hello.add_codecs(codec::kCodecHierarchical);
  hello.set_scene(scene_);
  hello.set_client_name("clothstream load");
  hello.set_display_name("intruder");
  hello.set_role(v1::ROLE_PARTICIPANT);
  return message.SerializeAsString();
}

void HostileClient::visit() {
  gone_ = joined_ = false;
  ++visits_;
  link_ = links_.open(*this);
  if (kind_ == kRandomBytes) {
    std::string noise(200, '\0');
    for (std::size_t i = 0; i < noise.size(); ++i) noise[i] = static_cast<char>(i * i + 7 * visits_);
    link_->send(std::move(noise));
  } else if (kind_ == kHuge) {
    link_->send(std::string(kHugeBytes, 'x'));
  } else {
    if (!token_.empty()) {
      v1::ClientMessage message;
      message.mutable_authenticate()->set_token(token_);
      link_->send(message.SerializeAsString());
    }
    link_->send(hello());
  }
  if (kind_ == kNotFinite) {
    v1::ClientMessage message;
    v1::ParticipantCollider& collider = *message.mutable_collider_poses()->add_colliders();
    collider.mutable_pose()->mutable_position()->set_x(std::numeric_limits<float>::quiet_NaN());
    collider.mutable_sphere()->set_radius(std::numeric_limits<float>::infinity());
    link_->send(message.SerializeAsString());
  }
  if (kind_ != kNeverReads) link_->read();
}

void HostileClient::received(std::span<const std::byte> /*message*/) {
  joined_ = true;
  link_->read();
}

void HostileClient::step(std::chrono::steady_clock::time_point now) {
  if (!link_) {
    if (now - since_ < kPause) return;
    since_ = now;
    return visit();
  }
  if (kind_ == kNeverReads) {
    v1::ClientMessage request;
    request.set_request_id(1);
    request.mutable_list_scenes();
    for (int i = 0; i < kRequestsAStep; ++i) link_->send(request.SerializeAsString());
  }
  if (!gone_ && !(kind_ == kLeavesAtOnce && joined_) && now - since_ < kPatience) return;
  drop();
  since_ = now;
  kind_ = (kind_ + 1) % kKinds;
}

}  // namespace clothstream::load
