// SPDX-License-Identifier: MIT
// A request about a scene, on a separate connection.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include "clients/load/link.h"
#include "clients/native/failure.h"
#include "clothstream/v1/session.pb.h"

namespace clothstream::load {

// Creates or deletes one scene.
class SceneRequest final : private LinkListener {
 public:
  struct Answer {
    std::optional<Failure> failure;  // none: it is done
    std::chrono::steady_clock::time_point arrived;
  };

  // Connects and sends the request, after the token unless that is empty.
  SceneRequest(Links& links, const std::string& token, const v1::ClientMessage& request);
  // Disconnects. A server that still makes the scene gives it up then.
  ~SceneRequest();
  SceneRequest(const SceneRequest&) = delete;
  SceneRequest& operator=(const SceneRequest&) = delete;

  // Nothing until the server has answered or the connection has ended.
  std::optional<Answer> answer() const;
  std::chrono::steady_clock::time_point sent() const { return sent_; }

 private:
  void received(std::span<const std::byte> message) override;
  void closed(const std::string& why) override;
  // Only the first answer counts.
  void answerWith(std::optional<Failure> failure);

  const std::chrono::steady_clock::time_point sent_ = std::chrono::steady_clock::now();
  mutable std::mutex mutex_;
  std::optional<Answer> answer_;
  std::unique_ptr<Link> link_;
};

}  // namespace clothstream::load
