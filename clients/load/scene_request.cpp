// SPDX-License-Identifier: MIT
#include "clients/load/scene_request.h"

#include <utility>

namespace clothstream::load {

SceneRequest::SceneRequest(Links& links, const std::string& token, const v1::ClientMessage& request)
    : link_(links.open(*this)) {
  if (!token.empty()) {
    v1::ClientMessage proof;
    proof.mutable_authenticate()->set_token(token);
    link_->send(proof.SerializeAsString());
  }
  link_->send(request.SerializeAsString());
  link_->read();
}

SceneRequest::~SceneRequest() {
  link_->drop();
}

std::optional<SceneRequest::Answer> SceneRequest::answer() const {
  const std::lock_guard lock(mutex_);
  return answer_;
}

void SceneRequest::received(std::span<const std::byte> bytes) {
  v1::ServerMessage message;
  if (message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    if (message.has_error()) answerWith(Failure{Failure::Kind::refused, message.error().text()});
    if (message.has_create_scene() || message.has_delete_scene()) answerWith(std::nullopt);
  }
  link_->read();
}

void SceneRequest::closed(const std::string& why) {
  answerWith(Failure{Failure::Kind::unreachable, why});
}

void SceneRequest::answerWith(std::optional<Failure> failure) {
  const std::lock_guard lock(mutex_);
  if (!answer_) answer_ = Answer{std::move(failure), std::chrono::steady_clock::now()};
}

}  // namespace clothstream::load
