// SPDX-License-Identifier: MIT
// A client without a transport, for tests: what it would say, and what it makes of what it hears.
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
// One sphere collider of radius 0.2 m with id 1; none if there is no position.
std::string colliderPose(std::optional<float> x);
// As many bytes, which are no ClientMessage.
std::string garbage(std::size_t bytes);

class Viewer {
 public:
  // Takes one serialised ServerMessage in. Returns what a polite client answers, if anything: a FrameAck, or
  // a KeyFrameRequest. A test fails here if the bytes are no ServerMessage, or a frame decodes to something
  // else than its hash says.
  std::optional<std::string> hear(std::string_view message);

  v1::ServerMessage last;
  v1::Welcome welcome;
  v1::StreamDescription description;  // vertices empty until all its chunks are here
  v1::Frame frame;                    // the newest decoded
  std::uint64_t frames = 0;           // decoded
  std::uint64_t pongs = 0;
  std::vector<v1::Error> errors;
  std::vector<v1::Notice> notices;

  std::uint64_t tick() const { return decoder_ ? decoder_->tick() : 0; }
  // A participant's collider of the newest frame.
  std::optional<v1::ColliderState> colliderOf(std::uint64_t participant) const;

 private:
  void hearChunk(const v1::Chunk& chunk);
  std::string hearFrame(const v1::Frame& heard);

  std::string content_;
  std::unique_ptr<codec::Decoder> decoder_;
};

}  // namespace clothstream::tests
