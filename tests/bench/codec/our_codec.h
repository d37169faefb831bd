// SPDX-License-Identifier: MIT
// Codec 2 as FrameCodec.
#pragma once

#include <memory>
#include <vector>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/bench/codec/frame_codec.h"

namespace clothstream::bench {

class OurCodec final : public FrameCodec {
 public:
  // `workers`, if any, must outlive it.
  explicit OurCodec(const codec::StreamLayout& layout, codec::Workers* workers = nullptr);

  std::string name() const override;
  double promise() const override;
  std::span<const std::byte> encode(const TrueFrame& frame) override;
  std::span<const float> decode(std::span<const std::byte> packet) override;
  std::span<const float> normals() const override;
  void check() const override;

 private:
  codec::StreamLayout layout_;
  bool hasWorkers_;
  std::unique_ptr<codec::Encoder> encoder_;
  std::unique_ptr<codec::Decoder> decoder_;
  std::vector<std::byte> packet_;
};

}  // namespace clothstream::bench
