// SPDX-License-Identifier: MIT
// Encoder on the CPU: vertices to packets. It is the reference for the kernels, which give the same bits.
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
  // Index of the layout's quality that this encoder writes. Each quality of a stream needs its own encoder.
  std::uint8_t quality = 0;
  // Number of frames between a frame and the newest frame that its weights are fitted to; the weights of a
  // key frame are fitted to an earlier key frame. 0 fits to all earlier frames, and fits a key frame to
  // itself. A lag lets later frames be prepared before earlier ones are coded. Decoders do not depend on it.
  std::uint32_t weightLag = 0;
  // Threads that predict large frames, with the same result to the bit. They must outlive the encoder.
  // Without them the caller's thread does all work.
  Workers* workers = nullptr;
};

// One encoder for each stream and quality. Not thread-safe. Allocates only at construction.
class Encoder {
 public:
  // nullptr if the layout is impossible (stream_layout.h) or has no such quality.
  static std::unique_ptr<Encoder> make(const StreamLayout& layout, const EncoderOptions& options = {});
  ~Encoder();
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  std::size_t packetBound() const;

  // Encodes one frame into `out`, which has at least packetBound() bytes, and returns the size of the packet.
  // `positions` are metres relative to StreamLayout::origin, 3 floats a vertex. Coordinates beyond reachOf()
  // (reach.h) are clamped, and NaN too: the packet then decodes, but not to these positions. Callers check.
  // `normals` have about unit length, or are empty if the layout has none. `tick` must grow from call to
  // call, except after forgetHistory(). The first frame is always a key frame. A predicted frame refers to
  // the previous frame.
  std::size_t encode(std::uint64_t tick, PacketKind kind, std::span<const float> positions,
                     std::span<const float> normals, std::span<std::byte> out);

  // Makes the next frame a key frame.
  void forgetHistory();

  // Kind and reference of the newest frame, as in its header; the reference of a key frame is 0.
  PacketKind kind() const;
  std::uint64_t referenceTick() const;

  // Hash of the newest frame. Equals the decoder's hash.
  std::uint64_t reconstructionHash() const;

 private:
  struct State;
  explicit Encoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace clothstream::codec
