// SPDX-License-Identifier: MIT
// Encodes frames of a motion and proves that they decode to the motion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <tl/expected.hpp>

#include "clients/cli/error.h"
#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"

namespace clothstream::cli {

// Each frame is decoded and compared with its positions.
class CheckedEncoder {
 public:
  // `name` is that of the motion, for errors. Fails if the layout is impossible or memory is out.
  [[nodiscard]] static tl::expected<CheckedEncoder, Error> make(const codec::StreamLayout& layout,
                                                                std::string name);

  // Positions are finite. The packet is valid until the next call. Fails if a coordinate is beyond the range
  // of the max error, or if the packet does not keep the promise of the max error.
  [[nodiscard]] tl::expected<std::span<const std::byte>, Error> encode(std::uint64_t tick,
                                                                       codec::PacketKind kind,
                                                                       std::span<const float> positions);

  std::uint64_t reconstructionHash() const { return encoder_->reconstructionHash(); }
  // Largest distance of a decoded vertex from its place so far, and the largest that was promised. Metres.
  double largestError() const { return largestError_; }
  double promise() const;
  double encodeMs() const { return encodeMs_; }
  double decodeMs() const { return decodeMs_; }

 private:
  CheckedEncoder(float maxError, std::string name, std::unique_ptr<codec::Encoder> encoder,
                 std::unique_ptr<codec::Decoder> decoder);

  float maxError_, reach_;
  std::string name_;
  std::unique_ptr<codec::Encoder> encoder_;
  std::unique_ptr<codec::Decoder> decoder_;
  std::vector<std::byte> packet_;
  std::uint64_t frame_ = 0;
  float farthest_ = 0;  // largest magnitude of a coordinate so far
  double largestError_ = 0, encodeMs_ = 0, decodeMs_ = 0;
};

}  // namespace clothstream::cli
