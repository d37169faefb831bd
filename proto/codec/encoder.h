// SPDX-License-Identifier: MIT
// Vertices to packets on the CPU: the reference that the kernels equal to the bit.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "proto/codec/packet_header.h"
#include "proto/codec/stream_layout.h"
#include "proto/codec/workers.h"

namespace clothstream::codec {

struct EncoderOptions {
  // Of the layout's: a stream in another one is another encoder's.
  std::uint8_t quality = 0;
  // Of one temporal layer: the weights of a frame are fitted to the frames that are so many or more
  // before it, and a key frame's to an earlier one's, as they are where frames are prepared before those
  // before them are coded. 0: all frames before it, and itself. For any of them a decoder is the same.
  std::uint32_t weightLag = 0;
  // Large frames are predicted by all of them, to the same bits; they outlive the encoder. None: by the
  // caller alone.
  Workers* workers = nullptr;
};

// One encoder a stream; not thread-safe. Memory is taken once, at construction.
class Encoder {
 public:
  // nullptr if the layout is impossible (stream_layout.h), or has no such quality.
  static std::unique_ptr<Encoder> make(const StreamLayout& layout, const EncoderOptions& options = {});
  ~Encoder();
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  std::size_t packetBound() const;

  // 3 floats a vertex, metres, within 2^27 units (32 m at any max error); normals of about unit length, or
  // nothing where the layout has none. `tick` must grow from call to call, but where history was forgotten. A
  // predicted frame refers to the frame encoded before, or with temporal layers to the newest of a lower
  // layer (of its own in the base), and the header says which; the first is always a key frame, whatever is
  // asked. Writes to `out` (at least packetBound() bytes) and returns the number of bytes written.
  std::size_t encode(std::uint64_t tick, PacketKind kind, std::span<const float> positions,
                     std::span<const float> normals, std::span<std::byte> out);

  // The next frame is a key frame.
  void forgetHistory();

  // Layer and reference of the newest frame, as in its header; the reference of a key frame is 0.
  std::uint8_t layer() const;
  std::uint64_t referenceTick() const;

  // Of the newest frame; equal to the decoder's.
  std::uint64_t reconstructionHash() const;

 private:
  struct State;
  explicit Encoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::codec
