// SPDX-License-Identifier: MIT
// A client in the same process: exchanges serialised messages with a Session and decodes its frames.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/decoder.h"
#include "server/hosting/scene_server.h"
#include "server/session/session.h"

namespace clothstream::tests {

// A received and decoded frame.
struct SeenFrame {
  std::uint64_t tick = 0;
  bool key = false;
  std::uint8_t quality = 0;
  std::uint64_t stateHash = 0;
  delivery::SharedBytes message;
  std::vector<v1::ColliderState> colliders;
};

// Belongs to one thread. Reads only while a function waits. Such a function throws std::runtime_error after
// kPatience.
class TestPeer {
 public:
  static constexpr std::chrono::seconds kPatience{180};

  // A peer of this machine without a token.
  explicit TestPeer(hosting::SceneServer& server, std::string name = "test")
      : TestPeer(server, session::Arrival{.peer = std::move(name), .address = {}, .token = {}}) {}
  TestPeer(hosting::SceneServer& server, session::Arrival arrival);

  void send(const v1::ClientMessage& message);
  void sendBytes(const std::string& bytes);
  void hello(const std::string& scene = "");
  void hello(const v1::Hello& hello);
  void poses(const std::vector<std::pair<std::uint32_t, float>>& idsAndXs);
  void change(const v1::ParameterChange& change);

  // Says hello and reads until the first frame is decoded.
  void join(const std::string& scene = "");

  // Reads until `wanted` returns true for a message, and returns that message.
  v1::ServerMessage readUntil(const std::function<bool(const v1::ServerMessage&)>& wanted);
  v1::ServerMessage readUntil(v1::ServerMessage::BodyCase body);
  // Reads until `count` more frames are decoded.
  void readFrames(std::size_t count);
  // Reads until the session is finished and has no more messages. Returns the last message.
  v1::ServerMessage readToTheEnd();

  bool finished() const { return session_->finished(); }
  // Ends without a goodbye, like a lost connection. The server keeps the participant's place for the grace
  // period.
  void vanish() { session_.reset(); }
  // Takes over the description and decoder of `other`, which cannot decode frames afterwards.
  void inherit(TestPeer& other) {
    description_ = other.description_;
    decoder_ = std::move(other.decoder_);
  }
  // Says goodbye.
  void leave() {
    session_->leave();
    session_.reset();
  }
  void closePage() {
    session_->closePage();
    session_.reset();
  }

  const v1::Welcome& welcome() const { return welcome_; }
  const v1::StreamDescription& description() const { return description_; }
  const std::vector<SeenFrame>& frames() const { return frames_; }
  const codec::Decoder& decoder() const { return *decoder_; }

  bool acknowledges = true;
  v1::Role role = v1::ROLE_UNSPECIFIED;  // asked for by hello(scene) and join()

 private:
  std::optional<v1::ServerMessage> read();
  void see(const v1::ServerMessage& message, const delivery::SharedBytes& bytes);
  void seeChunk(const v1::Chunk& chunk);
  void seeFrame(const v1::Frame& frame, const delivery::SharedBytes& bytes);

  std::mutex mutex_;
  std::condition_variable woken_;
  bool awake_ = false;

  v1::Welcome welcome_;
  std::string content_;
  v1::StreamDescription description_;
  std::unique_ptr<codec::Decoder> decoder_;
  std::vector<SeenFrame> frames_;

  std::shared_ptr<session::Session> session_;
};

}  // namespace clothstream::tests
