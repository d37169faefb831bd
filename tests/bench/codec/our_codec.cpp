// SPDX-License-Identifier: MIT
#include "tests/bench/codec/our_codec.h"

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace clothstream::bench {

OurCodec::OurCodec(const codec::StreamLayout& layout, codec::Workers* workers)
    : layout_(layout),
      hasWorkers_(workers != nullptr),
      encoder_(codec::Encoder::make(layout, {.workers = workers})),
      decoder_(codec::Decoder::make(layout)),
      packet_(encoder_->packetBound()) {}

std::string OurCodec::name() const {
  std::string name = fmt::format("codec {}", layout_.codec);
  if (hasWorkers_) name += ", several threads";
  if (layout_.normals != codec::NormalMode::none) name += ", with normals";
  return name;
}

double OurCodec::promise() const {
  return std::sqrt(3.0) * double{layout_.maxError};
}

std::span<const std::byte> OurCodec::encode(const TrueFrame& frame) {
  const bool normals = layout_.normals != codec::NormalMode::none;
  const std::size_t bytes = encoder_->encode(frame.frame + 1, codec::PacketKind::predicted, frame.positions,
                                             normals ? frame.normals : std::span<const float>(), packet_);
  return std::span(packet_).first(bytes);
}

std::span<const float> OurCodec::decode(std::span<const std::byte> packet) {
  if (decoder_->decode(packet) != codec::DecodeResult::ok)
    throw std::runtime_error(fmt::format("{} cannot decode its packet", name()));
  return decoder_->positions();
}

std::span<const float> OurCodec::normals() const {
  return layout_.normals == codec::NormalMode::none ? std::span<const float>() : decoder_->normals();
}

void OurCodec::check() const {
  if (decoder_->reconstructionHash() != encoder_->reconstructionHash())
    throw std::runtime_error(fmt::format("{} decodes to a different state", name()));
}

}  // namespace clothstream::bench
