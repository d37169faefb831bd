// SPDX-License-Identifier: MIT
// Interface to a codec that is measured: a stream of frames of one cloth, encoded and decoded.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace clothstream::bench {

// 3 floats a vertex each.
struct TrueFrame {
  std::uint32_t frame = 0;  // counted from 0
  std::span<const float> positions, normals;
  // True for each vertex that has moved by less than kCalmMetres since the previous frame.
  std::span<const std::uint8_t> calm;
};

// A few centimetres a second at 72 frames a second.
inline constexpr double kCalmMetres = 0.0005;

class FrameCodec {
 public:
  virtual ~FrameCodec() = default;
  virtual std::string name() const = 0;
  // Maximum distance of a decoded vertex from its true position, in metres.
  virtual double promise() const = 0;
  // Returns the packet, valid until the next call.
  virtual std::span<const std::byte> encode(const TrueFrame& frame) = 0;
  // Returns the packet's positions in the order of the frame, valid until the next call. Throws
  // std::runtime_error on failure.
  virtual std::span<const float> decode(std::span<const std::byte> packet) = 0;
  // Normals of the decoded frame, if the codec sends any.
  virtual std::span<const float> normals() const { return {}; }
  // Throws std::runtime_error if the codec can tell that it did not decode what it encoded.
  virtual void check() const {}
};

}  // namespace clothstream::bench
