// SPDX-License-Identifier: MIT
// Messages as a server says them, for tests of the client: a small wavy cloth or two through the real
// encoder.
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
  std::uint8_t temporalLayers = 1, qualities = 1;
};

// Bytes are serialised ServerMessages.
class ScriptedServer {
 public:
  explicit ScriptedServer(ScriptedStream stream = {});

  std::string welcome() const;
  v1::StreamDescription description() const;
  // The description in pieces of `pieceBytes`.
  std::vector<std::string> chunks(std::size_t pieceBytes = 256 * 1024, std::uint64_t contentId = 1) const;
  // Of one tick, which must grow from call to call.
  std::string frame(std::uint64_t tick, codec::PacketKind kind = codec::PacketKind::predicted);
  // Frames of this quality from now on; the next is to be a key frame.
  void goTo(std::uint8_t quality);
  // A ball that jumps by 1 m a tick, a finger of participant 7 that moves by 2 cm and turns by 0.1, and
  // others that stay.
  v1::Frame frameMessage(std::uint64_t tick, codec::PacketKind kind);

  // What was encoded last.
  const std::vector<float>& positions() const { return positions_; }

  static std::string serialise(const v1::Frame& frame);
  static std::string operatingPoint(std::uint32_t quality, std::uint32_t temporalLayers);
  static std::string pong(std::uint64_t clientTimeUs, std::uint64_t serverTimeUs);
  static std::string error(v1::ErrorCode code, const std::string& text, bool fatal);

 private:
  void pose(std::uint64_t tick);

  ScriptedStream stream_;
  codec::StreamLayout layout_;
  std::unique_ptr<codec::Encoder> encoder_;
  std::vector<float> positions_, normals_;
};

// Pieces of any content.
std::vector<std::string> chunksOf(const std::string& content, std::size_t pieceBytes,
                                  std::uint64_t contentId);

// A client under test, and what it said.
class ClientUnderTest {
 public:
  explicit ClientUnderTest(const char* scene = "curtain") : client_(cs_create(scene, "test"), &cs_destroy) {}

  cs_client* get() const { return client_.get(); }
  // The bytes are copied to a buffer of exactly their size, so that the sanitizer sees a read past it.
  std::uint32_t receive(const std::string& message, std::uint64_t nowUs = 0);
  void receiveAll(const std::vector<std::string>& messages, std::uint64_t nowUs = 0);
  // Welcome and description.
  void join(const ScriptedServer& server);
  std::vector<v1::ClientMessage> outgoing();
  cs_statistics statistics(std::uint64_t nowUs = 0) const;

 private:
  std::unique_ptr<cs_client, decltype(&cs_destroy)> client_;
};

// One that joined, and has nothing more to say.
struct JoinedClient {
  JoinedClient() { client.join(ScriptedServer()); }
  // The one message that it has to say now.
  v1::ClientMessage sent() {
    const auto messages = client.outgoing();
    EXPECT_EQ(messages.size(), 1u);
    return messages.empty() ? v1::ClientMessage() : messages[0];
  }
  ClientUnderTest client;
};

}  // namespace clothstream::client
