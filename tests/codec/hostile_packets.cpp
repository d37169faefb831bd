// SPDX-License-Identifier: MIT
// Promises of the decoder that mutated packets check, for bytes from any source.
#include "tests/codec/hostile_packets.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

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

// Checks the same for a decoder of coarse vertices, with the coarse packet.
void decodeHostileCoarse(const GoldenStream& stream, std::size_t place, std::span<const std::byte> bytes,
                         bool isTakenWhole) {
  const auto decoder = Decoder::make(stream.layout, Detail::coarse);
  std::vector<std::byte> smaller(bytes.size());
  const std::size_t size = makeCoarsePacket(bytes, smaller);
  require(size <= bytes.size(), "a coarse packet is not larger");
  if (decoder == nullptr) return;
  for (std::size_t i = 0; i < place; ++i) {
    require(decoder->decode(stream.packets[i].bytes) == DecodeResult::ok,
            "golden packets hold coarse vertices");
  }
  if (decoder->decode(std::span(smaller).first(size)) == DecodeResult::ok)
    requireFinite(decoder->positions());
  else
    require(!isTakenWhole, "what is decoded holds coarse vertices");
}

}  // namespace

void decodeHostile(const GoldenStream& stream, std::size_t place, std::span<const std::byte> bytes) {
  const auto decoder = Decoder::make(stream.layout);
  for (std::size_t i = 0; i < place; ++i) {
    require(decoder->decode(stream.packets[i].bytes) == DecodeResult::ok, "golden packets are decoded");
  }
  const bool hadFrame = decoder->hasFrame();
  const std::uint64_t tick = decoder->tick(), hash = decoder->reconstructionHash();
  const bool isTaken = decoder->decode(bytes) == DecodeResult::ok;
  if (isTaken) {
    require(decoder->hasFrame() && (!hadFrame || decoder->tick() > tick), "a decoded frame is newer");
    requireFinite(decoder->positions());
    requireFinite(decoder->normals());
  } else {
    require(
        decoder->hasFrame() == hadFrame && decoder->tick() == tick && decoder->reconstructionHash() == hash,
        "a refused packet changes nothing");
  }
  decodeHostileCoarse(stream, place, bytes, isTaken);
  for (std::size_t i = place; i < stream.packets.size(); ++i) {
    if (decoder->decode(stream.packets[i].bytes) == DecodeResult::ok) requireFinite(decoder->positions());
  }
  if (decoder->hasFrame()) return;
  require(decoder->decode(stream.packets[0].bytes) == DecodeResult::ok, "a key frame is decoded");
}

}  // namespace clothstream::codec
