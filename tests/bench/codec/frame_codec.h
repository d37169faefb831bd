// SPDX-License-Identifier: MIT
// A codec as it is measured: a stream of frames of one cloth, coded and decoded again.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace clothstream::bench {

// 3 floats a vertex each.
struct TrueFrame {
  std::uint32_t frame = 0;  // from 0 on
  std::span<const float> positions, normals;
  // Of each vertex, whether it is as good as still: since the frame before it has moved by less than
  // kCalmMetres.
  std::span<const std::uint8_t> calm;
};

// A few centimetres a second at 72 frames a second.
inline constexpr double kCalmMetres = 0.0005;

class FrameCodec {
 public:
  virtual ~FrameCodec() = default;
  virtual std::string name() const = 0;
  // How far a decoded vertex may be from where it was, m.
  virtual double promise() const = 0;
  // The packet; until the next call.
  virtual std::span<const std::byte> encode(const TrueFrame& frame) = 0;
  // The packet's positions, in the order of the frame; until the next call. Throws std::runtime_error where
  // it cannot.
  virtual std::span<const float> decode(std::span<const std::byte> packet) = 0;
  // Of the decoded frame, where the codec sends any.
  virtual std::span<const float> normals() const { return {}; }
  // Throws std::runtime_error where what was decoded is not what was encoded and the codec can tell.
  virtual void check() const {}
};

}  // namespace clothstream::bench
