// SPDX-License-Identifier: MIT
// Client without a transport, for tests: makes messages and decodes what it receives.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "clothstream/v1/session.pb.h"
#include "proto/codec/decoder.h"

namespace clothstream::tests {

// Serialised ClientMessages.
std::string hello(const std::string& scene = "");
std::string ping(std::uint64_t clientTimeUs = 1);
// One sphere collider of radius 0.2 m with id 1, or no collider without `x` (m).
std::string colliderPose(std::optional<float> x);
// `bytes` bytes that are not a ClientMessage.
std::string garbage(std::size_t bytes);

// Decodes the messages of one stream.
class Viewer {
 public:
  // Takes one serialised ServerMessage. Returns the answer of a well-behaved client, if any: a FrameAck or a
  // KeyFrameRequest. The test fails if the bytes are not a ServerMessage, or a decoded frame does not match
  // its hash.
  std::optional<std::string> receive(std::string_view message);

  v1::ServerMessage last;
  v1::Welcome welcome;
  v1::StreamDescription description;  // without vertices until all chunks are received
  v1::Frame frame;                    // newest decoded frame
  std::uint64_t frames = 0;           // decoded frames
  std::uint64_t pongs = 0;
  std::vector<v1::Error> errors;
  std::vector<v1::Notice> notices;

  std::uint64_t tick() const { return decoder_ ? decoder_->tick() : 0; }
  // The participant's collider in the newest frame.
  std::optional<v1::ColliderState> colliderOf(std::uint64_t participant) const;

 private:
  void receiveChunk(const v1::Chunk& chunk);
  std::string receiveFrame(const v1::Frame& received);

  std::string content_;
  std::unique_ptr<codec::Decoder> decoder_;
};

}  // namespace clothstream::tests
