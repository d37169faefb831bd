// SPDX-License-Identifier: MIT
// Rewrites tests/golden; run it from the project's root. Only for changes of the format, never to make a test
// pass.
#include <algorithm>
#include <cstdio>
#include <exception>
#include <utility>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/codec/cut_grid.h"
#include "tests/codec/golden.h"
#include "tests/codec/motion.h"
#include "tests/codec/packet_crafter.h"

namespace clothstream::codec {
namespace {

struct Moment {
  std::uint64_t tick;
  PacketKind kind;
  MotionFrame frame;
  std::uint8_t quality = 0;
};

// A stream that is being made: its packets are decoded at once.
class Making {
 public:
  Making(const std::string& name, const StreamLayout& layout)
      : stream_{.name = name, .layout = layout, .packets = {}, .normals = {}},
        decoder_(Decoder::make(layout)),
        coarse_(Decoder::make(layout, Detail::coarse)) {}

  // False if a decoder refuses the packet, which is then left out.
  bool add(std::span<const std::byte> packet) {
    const std::optional<ParsedPacket> parsed = parsePacket(packet);
    std::vector<std::byte> smaller(packet.size());
    smaller.resize(makeCoarsePacket(packet, smaller));
    if (decoder_->decode(packet) != DecodeResult::ok) return false;
    const std::string file = stream_.name + "_" + std::to_string(parsed->header.tick) + ".bin";
    if (coarse_->decode(smaller) != DecodeResult::ok) throw std::runtime_error(file + " is not coarse, too");
    stream_.packets.push_back({.file = file,
                               .bytes = {packet.begin(), packet.end()},
                               .tick = parsed->header.tick,
                               .kind = parsed->header.kind,
                               .reconstructionHash = decoder_->reconstructionHash(),
                               .positionsHash = hashFloats(decoder_->positions()),
                               .coarsePositionsHash = hashFloats(coarse_->positions())});
    return true;
  }

  void refuse(const std::string& why, std::vector<std::byte> packet) {
    const std::string file = stream_.name + "_" + why + ".bin";
    if (decoder_->decode(packet) != DecodeResult::malformed)
      throw std::runtime_error(file + " is not refused");
    stream_.refused.push_back({file, std::move(packet)});
  }

  std::uint64_t reconstructionHash() const { return decoder_->reconstructionHash(); }
  const GoldenStream& stream() const { return stream_; }
  // Role of a predicted frame after all packets.
  FrameRole next() const {
    return {.tick = decoder_->tick() + 1, .kind = PacketKind::predicted, .referenceTick = decoder_->tick()};
  }
  GoldenStream take() {
    stream_.normals = sampleNormals(decoder_->normals());
    return std::move(stream_);
  }

 private:
  GoldenStream stream_;
  std::unique_ptr<Decoder> decoder_, coarse_;
};

GoldenStream makeStream(const std::string& name, const StreamLayout& layout,
                        const std::vector<Moment>& moments) {
  Making making(name, layout);
  std::vector<std::unique_ptr<Encoder>> encoders;  // indexed by quality
  for (std::uint8_t quality = 0; quality < layout.qualities; ++quality)
    encoders.push_back(Encoder::make(layout, {.quality = quality}));
  std::vector<std::byte> packet(encoders[0]->packetBound());
  for (const auto& [tick, kind, frame, quality] : moments) {
    Encoder* const encoder = encoders[quality].get();
    const std::size_t bytes = encoder->encode(tick, kind, frame.positions, frame.normals, packet);
    if (!making.add(std::span(packet).first(bytes)) ||
        making.reconstructionHash() != encoder->reconstructionHash())
      throw std::runtime_error(name + " cannot be decoded");
  }
  return making.take();
}

// A motion, a still moment and a jump, so that every prediction is used.
GoldenStream makeStream(const std::string& name, const StreamLayout& layout) {
  return makeStream(name, layout,
                    {{1, PacketKind::key, sampleMotion(layout, 1, 0.05f)},
                     {2, PacketKind::predicted, sampleMotion(layout, 2, 0.05f)},
                     {130, PacketKind::predicted, sampleMotion(layout, 2, 0.05f)},
                     {131, PacketKind::predicted, scatter(layout, 1, 5)},
                     {132, PacketKind::predicted, sampleMotion(layout, 4, 0.05f)}});
}

// A motion that lasts until weights have been sent several times.
GoldenStream makeLongStream(const std::string& name, const StreamLayout& layout) {
  std::vector<Moment> moments;
  for (std::uint64_t tick = 1; tick <= 12; ++tick) {
    moments.push_back(
        {tick, tick == 1 ? PacketKind::key : PacketKind::predicted, sampleMotion(layout, tick, 0.02f)});
  }
  return makeStream(name, layout, moments);
}

// Three qualities. The stream changes to the next one at each key frame.
GoldenStream makeQualityStream() {
  StreamLayout layout = mixedLayout(NormalMode::octahedral);
  layout.qualities = 3;
  std::vector<Moment> moments;
  for (std::uint64_t tick = 1; tick <= 9; ++tick) {
    const std::uint64_t sinceKey = (tick - 1) % 3;
    moments.push_back({tick, sinceKey == 0 ? PacketKind::key : PacketKind::predicted,
                       sampleMotion(layout, tick, 0.03f), static_cast<std::uint8_t>((tick - 1) / 3)});
  }
  return makeStream("qualities", layout, moments);
}

// Half of the cloth is held still and starts to rest.
GoldenStream makeHeldStream() {
  const StreamLayout layout{.epoch = 9, .cloths = {{.vertexCount = 144, .rows = 12, .columns = 12}}};
  const MotionFrame start = sampleMotion(layout, 1, 0.02f);
  std::vector<Moment> moments;
  for (std::uint64_t tick = 1; tick <= 8; ++tick) {
    MotionFrame frame = sampleMotion(layout, tick, 0.02f);
    std::copy_n(start.positions.begin(), frame.positions.size() / 2, frame.positions.begin());
    moments.push_back({tick, tick == 1 ? PacketKind::key : PacketKind::predicted, frame});
  }
  return makeStream("held", layout, moments);
}

// A mesh and a grid, far from the origin of the world.
GoldenStream makeMeshStream() {
  constexpr std::uint32_t kEdge = 14;
  const ClothLayout grid{.vertexCount = kEdge * kEdge, .rows = kEdge, .columns = kEdge};
  CutGrid mesh(kEdge);
  const StreamLayout grids{.cloths = {grid, grid}};
  std::vector<Moment> moments;
  for (std::uint64_t tick = 1; tick <= 6; ++tick) {
    MotionFrame frame = sampleMotion(grids, tick, 0.02f);
    std::ranges::copy(mesh.renumbered(std::span(frame.positions).first(3 * grid.vertexCount)),
                      frame.positions.begin());
    moments.push_back({tick, tick == 1 ? PacketKind::key : PacketKind::predicted, frame});
  }
  return makeStream("mesh", {.epoch = 9, .cloths = {mesh.cloth(), grid}, .origin = {640, -128, 64}}, moments);
}

// The smallest grid with all kinds of vertices. The page FRAME_FORMAT.md shows these packets.
GoldenStream makeSmallStream() {
  const StreamLayout layout{
      .epoch = 5, .maxError = 0.01f, .cloths = {{.vertexCount = 9, .rows = 3, .columns = 3}}};
  Making making("small", layout);
  const auto encoder = Encoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  const auto encode = [&](std::uint64_t tick, PacketKind kind, std::uint64_t moment) {
    MotionFrame frame = sampleMotion(layout, moment, 0.3f);
    if (tick == 4) frame.positions[3 * 4] += 0.2f;
    const std::size_t bytes = encoder->encode(tick, kind, frame.positions, {}, packet);
    return std::span<const std::byte>(packet).first(bytes);
  };
  // The third frame has no residuals; in the fourth only the vertex in the middle moves.
  const bool isComplete =
      making.add(encode(1, PacketKind::key, 1)) && making.add(encode(2, PacketKind::predicted, 5)) &&
      making.add(encode(3, PacketKind::predicted, 5)) && making.add(encode(4, PacketKind::predicted, 5));
  if (!isComplete) throw std::runtime_error("small cannot be decoded");
  const std::span<const std::byte> next = encode(5, PacketKind::predicted, 12);
  making.refuse("boundary_of_symbols", withBoundaryMoved(next, hierarchical::kCoarseSymbols, 2));
  making.refuse("boundary_of_bits", withBoundaryMoved(next, hierarchical::kCoarseBits, 1));
  std::vector<std::byte> ofReservedCodec(next.begin(), next.end());
  ofReservedCodec[1] = std::byte{3};
  making.refuse("reserved_codec", std::move(ofReservedCodec));
  std::vector<std::byte> withReservedByte(next.begin(), next.end());
  withReservedByte[4] = std::byte{1};
  making.refuse("reserved_byte", std::move(withReservedByte));
  return making.take();
}

// A mesh with triangles that have equal corners, a grid with borders, and a vertex. Coordinates reach 60 m.
StreamLayout extremeLayout() {
  ClothLayout mesh = CutGrid(6).cloth();
  mesh.triangles.insert(mesh.triangles.end(), {3, 3, 7, 5, 5, 5, 11, 30, 11});
  return {.epoch = 5, .maxError = 0.00001f, .cloths = {std::move(mesh), {35, 5, 7}, {1, 1, 1}}};
}

// Weights and residuals of every size.
GoldenStream makeExtremeStream() {
  const StreamLayout layout = extremeLayout();
  Making making("extreme", layout);
  const auto encoder = Encoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  for (std::uint64_t tick = 1; tick <= 3; ++tick) {
    const MotionFrame frame = scatter(layout, static_cast<std::uint32_t>(tick), 30);
    const std::size_t bytes = encoder->encode(tick, PacketKind::predicted, frame.positions, {}, packet);
    if (!making.add(std::span(packet).first(bytes))) throw std::runtime_error("extreme cannot be decoded");
  }
  PacketCrafter crafter(layout);
  std::uint32_t seed = 0;
  for (int i = 0; i < 4; ++i) {
    while (!making.add(crafter.craft(making.next(), ++seed)))
      if (seed == 100'000) throw std::runtime_error("extreme has no packet within the range");
    crafter.keep();
  }
  using Fault = PacketCrafter::Fault;
  const FrameRole role = making.next();
  making.refuse("weight", crafter.craftWrong(role, Fault::weightBeyondTheLimit));
  making.refuse("gamma_number", crafter.craftWrong(role, Fault::gammaNumberOf31Bits));
  return making.take();
}

// A vertex that jumps. The number of its last residual along the normal has more than 32 bits, of which the
// lowest 32 count.
GoldenStream makeWrappedStream() {
  const StreamLayout layout{.epoch = 5, .maxError = 0.00001f, .cloths = {{.vertexCount = 1}}};
  Making making("wrapped", layout);
  const auto encoder = Encoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  const auto encode = [&](std::uint64_t tick) {
    const MotionFrame frame = scatter(layout, static_cast<std::uint32_t>(tick), 30);
    const std::size_t bytes = encoder->encode(tick, PacketKind::predicted, frame.positions, {}, packet);
    return std::span<const std::byte>(packet).first(bytes);
  };
  // Four bits of the number are not part of its upper part.
  constexpr std::uint32_t kBeyond32Bits = 1u << (32 - 4);
  const bool isComplete = making.add(encode(1)) && making.add(encode(2)) &&
                          making.add(withNumberRaised(encode(3), kBeyond32Bits));
  if (!isComplete || making.reconstructionHash() != encoder->reconstructionHash())
    throw std::runtime_error("wrapped cannot be decoded");
  making.refuse("coordinate", withNumberRaised(encode(4), 1u << 20));
  return making.take();
}

// A triangle from one end of the range to the other, so often that the sums of its normals need all of their
// 64 bits.
GoldenStream makeFarNormalsStream() {
  StreamLayout layout{
      .epoch = 5, .maxError = 0.00001f, .normals = NormalMode::octahedral, .cloths = {{.vertexCount = 3}}};
  for (int i = 0; i < 140; ++i)
    layout.cloths[0].triangles.insert(layout.cloths[0].triangles.end(), {0, 1, 2});
  const MotionFrame frame{.positions = {-59, -59, 1, 59, -59, 1, -59, 59, 2},
                          .normals = {0, 0, 1, 0, 0, 1, 0.6f, 0, 0.8f}};
  return makeStream("far_normals", layout, {{1, PacketKind::key, frame}});
}

}  // namespace
}  // namespace clothstream::codec

int main() try {
  using namespace clothstream::codec;
  writeGoldenStreams(
      {makeStream("hierarchical", mixedLayout(NormalMode::none)),
       makeStream("hierarchical_normals", mixedLayout(NormalMode::octahedral)), makeMeshStream(),
       makeStream("fine_hierarchical", {.epoch = 8,
                                        .maxError = 0.00002f,
                                        .normals = NormalMode::none,
                                        .cloths = {{.vertexCount = 150, .rows = 15, .columns = 10}}}),
       makeLongStream("weighted", {.epoch = 9, .cloths = {{.vertexCount = 400, .rows = 20, .columns = 20}}}),
       makeStream("vertex", {.epoch = 0xffffffffu,
                             .maxError = 0.01f,
                             .normals = NormalMode::none,
                             .cloths = {{.vertexCount = 1, .rows = 0, .columns = 0}}}),
       makeHeldStream(), makeQualityStream(), makeSmallStream(), makeExtremeStream(), makeFarNormalsStream(),
       makeWrappedStream()});
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
