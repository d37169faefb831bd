// SPDX-License-Identifier: MIT
// Simulated server for tests of the client: one or two small waving cloths, encoded by the real encoder.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clients/core/core.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/encoder.h"

namespace clothstream::client {

inline constexpr std::uint64_t kMs = 1000;  // us

struct ClothSize {
  std::string name;
  std::uint32_t rows, columns;
};

struct ScriptedStream {
  std::uint32_t epoch = 7;
  std::uint32_t simulationRate = 72, streamRate = 72;
  codec::NormalMode normals = codec::NormalMode::none;
  std::vector<ClothSize> cloths{{"curtain", 9, 7}};
  std::uint8_t qualities = 1;
};

// The functions return serialised ServerMessages.
class ScriptedServer {
 public:
  explicit ScriptedServer(ScriptedStream stream = {});

  std::string welcome() const;
  v1::StreamDescription description() const;
  // Description in chunks of `pieceBytes`.
  std::vector<std::string> chunks(std::size_t pieceBytes = 256 * 1024, std::uint64_t contentId = 1) const;
  // Frame of a tick. Ticks must grow from call to call.
  std::string frame(std::uint64_t tick, codec::PacketKind kind = codec::PacketKind::predicted);
  // Switches to this quality. The next frame must be a key frame.
  void goTo(std::uint8_t quality);
  // Frame with colliders: a ball that jumps by 1 m per tick, a finger of participant 7 that moves by 2 cm and
  // turns by 0.1 per tick, and others that do not move.
  v1::Frame frameMessage(std::uint64_t tick, codec::PacketKind kind);

  // Positions of the last encoded frame.
  const std::vector<float>& positions() const { return positions_; }

  static std::string serialise(const v1::Frame& frame);
  static std::string operatingPoint(std::uint32_t quality);
  static std::string pong(std::uint64_t clientTimeUs, std::uint64_t serverTimeUs);
  static std::string error(v1::ErrorCode code, const std::string& text, bool fatal,
                           const std::string& server = {});

 private:
  void pose(std::uint64_t tick);

  ScriptedStream stream_;
  codec::StreamLayout layout_;
  std::unique_ptr<codec::Encoder> encoder_;
  std::vector<float> positions_, normals_;
};

// Chunks of any content.
std::vector<std::string> chunksOf(const std::string& content, std::size_t pieceBytes,
                                  std::uint64_t contentId);

// Options of a client named "test".
cs_client_options optionsFor(const char* scene);
cs_own_collider sphereAt(float x, float y, float z, float radius);

// Client under test.
class ClientUnderTest {
 public:
  explicit ClientUnderTest(const char* scene = "curtain");

  cs_client* get() const { return client_.get(); }
  // Copies the bytes to a buffer of exactly their size, so that a sanitizer detects a read past the end.
  std::uint32_t receive(const std::string& message, std::uint64_t nowUs = 0);
  void receiveAll(const std::vector<std::string>& messages, std::uint64_t nowUs = 0);
  // Receives Welcome and description.
  void join(const ScriptedServer& server);
  std::vector<v1::ClientMessage> outgoing();
  cs_statistics statistics(std::uint64_t nowUs = 0) const;

 private:
  std::unique_ptr<cs_client, decltype(&cs_destroy)> client_;
};

// Client that has joined and has no outgoing messages.
struct JoinedClient {
  JoinedClient() { client.join(ScriptedServer()); }
  // The only outgoing message.
  v1::ClientMessage sent() {
    const auto messages = client.outgoing();
    EXPECT_EQ(messages.size(), 1u);
    return messages.empty() ? v1::ClientMessage() : messages[0];
  }
  ClientUnderTest client;
};

}  // namespace clothstream::client
