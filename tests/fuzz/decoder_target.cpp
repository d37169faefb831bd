// SPDX-License-Identifier: MIT
// What fuzzing asks of the decoder.
#include "tests/fuzz/decoder_target.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "proto/codec/decoder.h"

namespace clothstream::codec {
namespace {

void require(bool kept, const char* promise) {
  if (kept) return;
  std::fprintf(stderr, "the decoder broke its promise: %s\n", promise);
  std::abort();
}

void requireFinite(std::span<const float> values) {
  for (const float value : values) require(std::isfinite(value), "floats are finite");
}

}  // namespace

void decodeHostile(const GoldenStream& stream, std::size_t place, std::span<const std::byte> bytes) {
  const auto decoder = Decoder::make(stream.layout);
  for (std::size_t i = 0; i < place; ++i) {
    require(decoder->decode(stream.packets[i].bytes) == DecodeResult::ok, "golden packets are decoded");
  }
  const bool hadFrame = decoder->hasFrame();
  const std::uint64_t tick = decoder->tick(), hash = decoder->reconstructionHash();
  if (decoder->decode(bytes) == DecodeResult::ok) {
    require(decoder->hasFrame() && (!hadFrame || decoder->tick() > tick), "a decoded frame is newer");
    requireFinite(decoder->positions());
    requireFinite(decoder->normals());
  } else {
    require(
        decoder->hasFrame() == hadFrame && decoder->tick() == tick && decoder->reconstructionHash() == hash,
        "a refused packet changes nothing");
  }
  for (std::size_t i = place; i < stream.packets.size(); ++i) {
    if (decoder->decode(stream.packets[i].bytes) == DecodeResult::ok) requireFinite(decoder->positions());
  }
  if (decoder->hasFrame()) return;
  require(decoder->decode(stream.packets[0].bytes) == DecodeResult::ok, "a key frame is decoded");
}

}  // namespace clothstream::codec
