// SPDX-License-Identifier: MIT
// What a peer says and how the server answers: joining, input, questions, limits.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>

#include <tl/expected.hpp>

#include "server/stream/live_scene.h"
#include "server/stream/mailbox.h"
#include "server/stream/scene_server.h"
#include "server/stream/token_bucket.h"
#include "server/stream/upload.h"

namespace clothstream::stream {

// Thread-safe. What is wrong with a message is answered to this peer alone. Whoever is refused on and on is
// cut off: every refused message counts against a budget that refills with time, one that is no message at
// all counts for sixty.
class Session : public std::enable_shared_from_this<Session> {
 public:
  Session(SceneServer::State& server, std::string peer, std::function<void()> wake);

  void receive(std::span<const std::byte> bytes, Clock::time_point now);
  std::optional<SharedBytes> next(Clock::time_point now) { return mailbox_->next(now); }
  bool finished() const { return mailbox_->closed(); }

  // Closes with this as the last message, and leaves the scene for good. The first call counts.
  void close(SharedBytes last);
  // The peer leaves for good.
  void leave();
  // Cut off where nothing was heard for too long. To be called now and then.
  void checkSilence(Clock::time_point now);
  // The endpoint is gone: the peer is cut off, and nobody is woken any more.
  void end();

 private:
  void dispatch(const v1::ClientMessage& message, Clock::time_point now);
  void hello(const v1::Hello& message);
  void poses(const v1::ColliderPoses& message, Clock::time_point now);
  void upload(const v1::Chunk& chunk);
  void create(const v1::CreateSceneRequest& request);
  // Answers the message in hand when what it asks for is done.
  template <typename Response>
  std::function<void(tl::expected<Response, v1::Error>)> answering(Response* (v1::ServerMessage::*body)());
  void answer(v1::ServerMessage& message);
  void refuse(const messages::FieldError& reason, double cost = 1);
  void fail(v1::ErrorCode code, std::string text);
  bool allowed(TokenBucket& bucket, const char* what);
  // Whether this peer may do so to the scene of this name, as somebody in it or from outside: who it is
  // there, 0 from outside. Where not, that has been said.
  std::optional<std::uint64_t> actor(const std::string& scene, Act act);
  void refuseUnless(const messages::Result<void>& done);
  // How the participant is out of the scene, if it is in one.
  enum class Parting : std::uint8_t { left, removed, lost };
  void part(Parting how);
  void closeLocked(SharedBytes last, Parting how);

  SceneServer::State& server_;
  const std::string peer_;
  const std::shared_ptr<Mailbox> mailbox_;
  std::atomic<Clock::time_point> lastHeard_;

  std::mutex mutex_;  // of all below
  std::shared_ptr<LiveScene> scene_;
  std::uint64_t participant_ = 0;
  Upload upload_;
  // Of the message in hand.
  std::uint64_t requestId_ = 0;
  Clock::time_point now_{};

  TokenBucket poseRate_{480, 120};
  TokenBucket changeRate_{60, 30};
  TokenBucket keyFrameRate_{10, 5};
  TokenBucket pingRate_{20, 150};  // clients begin with many
  TokenBucket queryRate_{20, 20};
  TokenBucket controlRate_{10, 10};
  TokenBucket messageRate_{1000, 500};  // of all kinds
  TokenBucket offences_{100, 500};
  TokenBucket errorRate_{50, 50};  // told; further ones only count
};

}  // namespace clothstream::stream
