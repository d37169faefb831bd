// SPDX-License-Identifier: MIT
// The newest frame of a stream: decoded here, or taken from the client that a mirror follows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "clients/core/core.h"
#include "proto/codec/decoder.h"

namespace clothstream::client {

class NewestFrame {
 public:
  explicit NewestFrame(bool isMirror) : isMirror_(isMirror) {}

  bool isMirror() const { return isMirror_; }
  // Clock that measures decodeMs(), microseconds. Null: it is not measured.
  void setClock(std::uint64_t (*nowUs)()) { nowUs_ = nowUs; }

  // Starts a stream. Returns false, and changes nothing, if the layout is not possible.
  [[nodiscard]] bool begin(const codec::StreamLayout& layout);
  bool begun() const { return begun_; }

  // Decodes a packet. Not for a mirror.
  cs_decoding decode(std::span<const std::byte> packet);
  // Copies what the other client decoded from the packet of this tick. Only for a mirror.
  cs_decoding take(const cs_decoded* decoded, std::uint64_t tick);

  // Time of the last decode(), or what the other client has measured.
  double decodeMs() const { return decodeMs_; }
  // Whether there is a frame since begin(). The functions below require it.
  bool present() const;
  std::uint64_t tick() const;
  std::uint64_t hash() const;
  // 3 floats per vertex.
  std::span<const float> positions() const;
  // As sent, or else computed by the first call after the frame.
  std::span<const float> normals() const;

 private:
  struct Taken {
    std::uint64_t tick = 0, hash = 0;
    std::vector<float> positions;
    mutable std::vector<float> normals;  // empty if they are not computed yet
  };

  bool isMirror_, begun_ = false;
  std::unique_ptr<codec::Decoder> decoder_;
  codec::StreamLayout layout_;  // of a mirror
  bool isTaken_ = false;
  Taken taken_;
  std::uint64_t (*nowUs_)() = nullptr;
  double decodeMs_ = 0;
};

}  // namespace clothstream::client
