// SPDX-License-Identifier: MIT
// Decoder: packets to vertices. Safe on any bytes: it never reads or writes out of bounds, never allocates by
// an unchecked count, and always ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "proto/codec/coarse_packet.h"
#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"

namespace clothstream::codec {

enum class DecodeResult : std::uint8_t {
  ok,
  malformed,         // not a valid packet of this stream's codec
  wrongEpoch,        // packet of another description
  missingReference,  // the reference is not the newest decoded frame: request a key frame
  stale,             // not newer than the newest decoded frame
};

// One decoder for each stream. Not thread-safe. Allocates only at construction.
class Decoder {
 public:
  // nullptr if the layout is impossible (stream_layout.h) or memory is out.
  static std::unique_ptr<Decoder> make(const StreamLayout& layout, Detail detail = Detail::full);
  ~Decoder();
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  // A result other than `ok` leaves the decoder unchanged.
  [[nodiscard]] DecodeResult decode(std::span<const std::byte> packet);
  // Forgets all frames: only a key frame can follow, with any tick.
  void restart();

  // Tick of the newest decoded frame. Like positions, normals and hash it is undefined before the first
  // frame.
  std::uint64_t tick() const;
  bool hasFrame() const;

  // Positions in metres, 3 floats a vertex, cloth after cloth. Valid until the next decode. With
  // Detail::coarse the positions of other vertices are interpolated, without a promise about their error.
  std::span<const float> positions() const;
  // Unit normals, 3 floats a vertex: as sent, or computed from the positions if the stream sends none or with
  // Detail::coarse. Valid until the next decode. The first call after a decode does the work.
  std::span<const float> normals() const;
  // 64-bit hash of the reconstruction (FRAME_FORMAT.md). Equals the server's hash, except with
  // Detail::coarse.
  std::uint64_t reconstructionHash() const;

 private:
  struct State;
  explicit Decoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::codec
