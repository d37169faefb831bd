// SPDX-License-Identifier: MIT
// Packets to vertices. Safe on any bytes: it never reads or writes out of bounds, never allocates by an
// unchecked count, always ends.
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
  malformed,         // not a packet of this stream's codec; the decoder's state is as before
  wrongEpoch,        // of another description
  missingReference,  // refers to a tick that was not decoded, or is no longer held: ask for a key frame, or
                     // leave it out where it is of a layer above the base
  stale,             // not newer than what is decoded
};

// One decoder a stream; not thread-safe. Memory is taken once, at construction.
class Decoder {
 public:
  // nullptr if the layout is impossible (stream_layout.h), or memory is out.
  static std::unique_ptr<Decoder> make(const StreamLayout& layout, Detail detail = Detail::full);
  ~Decoder();
  Decoder(const Decoder&) = delete;
  Decoder& operator=(const Decoder&) = delete;

  [[nodiscard]] DecodeResult decode(std::span<const std::byte> packet);

  // Of the newest decoded frame, like all that follows; undefined before the first.
  std::uint64_t tick() const;
  bool hasFrame() const;

  // 3 floats a vertex, metres, cloths one after the other; valid until the next decode. With Detail::coarse
  // those that are not coarse lie between the others, without a promise.
  std::span<const float> positions() const;
  // 3 floats a vertex, unit length: as sent, or computed from the positions where the stream sends none. The
  // first call after a decode does the work.
  std::span<const float> normals() const;
  // 64-bit hash of the reconstruction; equal to the server's (FRAME_FORMAT.md), but with Detail::coarse.
  std::uint64_t reconstructionHash() const;

 private:
  struct State;
  explicit Decoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::codec
