// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/decoder_target.h"

#include <cmath>
#include <cstring>
#include <memory>
#include <vector>

#include "inputs.pb.h"
#include "proto/codec/decoder.h"
#include "tests/codec/golden.h"

namespace clothstream::fuzz {
namespace {

using Bytes = std::vector<std::byte>;

// Memory and time of a decoder are proportional to its vertices, and a layout of few bytes may name many.
constexpr std::uint64_t kMaxVertices = 16'384;
constexpr int kMaxPackets = 64;

codec::StreamLayout layoutOf(const DecoderInput::Layout& message) {
  codec::StreamLayout layout;
  layout.epoch = message.epoch();
  layout.codec = static_cast<std::uint8_t>(message.codec());
  layout.maxError = message.max_error();
  layout.normals = message.normals() == 0 ? codec::NormalMode::none : codec::NormalMode::octahedral;
  layout.qualities = static_cast<std::uint8_t>(message.qualities());
  for (const DecoderInput::Cloth& cloth : message.cloths())
    layout.cloths.push_back({cloth.vertex_count(),
                             cloth.rows(),
                             cloth.columns(),
                             {cloth.triangles().begin(), cloth.triangles().end()},
                             {cloth.rest_positions().begin(), cloth.rest_positions().end()}});
  return layout;
}

Bytes packetOf(const DecoderInput::Packet& message, const codec::GoldenStream& stream) {
  Bytes bytes;
  if (message.bytes().empty()) {
    bytes = stream.packets[message.golden() % stream.packets.size()].bytes;
  } else {
    const auto given = std::as_bytes(std::span(message.bytes()));
    bytes.assign(given.begin(), given.end());
  }
  for (const Patch& patch : message.patches()) {
    if (bytes.empty()) break;
    const std::size_t at = patch.offset() % bytes.size();
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    if (patch.cut() > 0) {
      bytes.erase(begin,
                  begin + static_cast<std::ptrdiff_t>(std::min<std::size_t>(patch.cut(), bytes.size() - at)));
      continue;
    }
    std::memcpy(bytes.data() + at, patch.bytes().data(), std::min(patch.bytes().size(), bytes.size() - at));
  }
  return bytes;
}

bool allFinite(std::span<const float> values) {
  for (const float value : values)
    if (!std::isfinite(value)) return false;
  return true;
}

// Decodes the packet if the decoder accepts it.
bool decode(codec::Decoder& decoder, const Bytes& packet) {
  const bool hadFrame = decoder.hasFrame();
  const std::uint64_t tick = hadFrame ? decoder.tick() : 0;
  const std::uint64_t hash = hadFrame ? decoder.reconstructionHash() : 0;
  if (decoder.decode(packet) != codec::DecodeResult::ok) {
    require(decoder.hasFrame() == hadFrame, "a refused packet gives no frame");
    require(!hadFrame || (decoder.tick() == tick && decoder.reconstructionHash() == hash),
            "a refused packet changes nothing");
    return false;
  }
  require(decoder.hasFrame() && (!hadFrame || decoder.tick() > tick), "a decoded frame is newer");
  require(allFinite(decoder.positions()), "positions are finite");
  require(allFinite(decoder.normals()), "normals are finite");
  return true;
}

void run(const DecoderInput& input) {
  static const std::vector<codec::GoldenStream> streams = codec::readGoldenStreams();
  const codec::GoldenStream& stream = streams[input.stream() % streams.size()];
  codec::StreamLayout layout = input.has_layout() ? layoutOf(input.layout()) : stream.layout;
  std::uint64_t vertices = 0;
  for (const codec::ClothLayout& cloth : layout.cloths) vertices += cloth.vertexCount;
  if (vertices > kMaxVertices) return;
  const auto decoder = codec::Decoder::make(layout),
             coarse = codec::Decoder::make(layout, codec::Detail::coarse);
  require((decoder != nullptr) == codec::isPossible(layout), "there is a decoder for every possible layout");
  if (!decoder) return;
  int packets = 0;
  for (const DecoderInput::Packet& message : input.packets()) {
    if (++packets > kMaxPackets) break;
    // Exactly sized, so that the sanitizer detects a read past the end.
    Bytes packet = packetOf(message, stream);
    packet.shrink_to_fit();
    if (input.coarse()) {
      decode(*coarse, packet);
      continue;
    }
    Bytes smaller(packet.size());
    const std::size_t size = codec::makeCoarsePacket(packet, smaller);
    require(size <= packet.size(), "a coarse packet is not larger");
    smaller.resize(size);
    smaller.shrink_to_fit();
    if (decode(*decoder, packet))
      require(decode(*coarse, smaller), "a packet that can be decoded holds coarse vertices");
  }
}

}  // namespace

const Target kDecoderTarget{.name = "decoder",
                            .run = &runStructured<DecoderInput, &run>,
                            .structure = &DecoderInput::default_instance()};

}  // namespace clothstream::fuzz
