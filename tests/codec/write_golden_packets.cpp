// SPDX-License-Identifier: MIT
// Rewrites tests/golden; run it from the project's root. Only for changes of the format, never to make a test
// pass.
#include <algorithm>
#include <cstdio>
#include <exception>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/codec/cut_grid.h"
#include "tests/codec/golden.h"
#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

struct Moment {
  std::uint64_t tick;
  PacketKind kind;
  MotionFrame frame;
  std::uint8_t quality = 0;
};

GoldenStream makeStream(const std::string& name, const StreamLayout& layout,
                        const std::vector<Moment>& moments) {
  GoldenStream stream{.name = name, .layout = layout, .packets = {}, .normals = {}};
  std::vector<std::unique_ptr<Encoder>> encoders;  // indexed by quality
  for (std::uint8_t quality = 0; quality < layout.qualities; ++quality)
    encoders.push_back(Encoder::make(layout, {.quality = quality}));
  const auto decoder = Decoder::make(layout), coarse = Decoder::make(layout, Detail::coarse);
  std::vector<std::byte> packet(encoders[0]->packetBound()), smaller(packet.size());
  for (const auto& [tick, kind, frame, quality] : moments) {
    Encoder* const encoder = encoders[quality].get();
    const std::size_t bytes = encoder->encode(tick, kind, frame.positions, frame.normals, packet);
    GoldenPacket golden{.file = name + "_" + std::to_string(tick) + ".bin",
                        .bytes = {packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(bytes)},
                        .tick = tick,
                        .kind = kind,
                        .reconstructionHash = encoder->reconstructionHash(),
                        .positionsHash = 0,
                        .coarsePositionsHash = 0};
    const std::size_t coarseBytes = makeCoarsePacket(golden.bytes, smaller);
    if (decoder->decode(golden.bytes) != DecodeResult::ok ||
        coarse->decode(std::span(smaller).first(coarseBytes)) != DecodeResult::ok)
      throw std::runtime_error(golden.file + " cannot be decoded");
    golden.positionsHash = hashFloats(decoder->positions());
    golden.coarsePositionsHash = hashFloats(coarse->positions());
    stream.packets.push_back(std::move(golden));
  }
  stream.normals = sampleNormals(decoder->normals());
  return stream;
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

// A motion that lasts until weights have been sent for each layer.
GoldenStream makeLongStream(const std::string& name, const StreamLayout& layout, std::uint64_t frames = 12) {
  std::vector<Moment> moments;
  for (std::uint64_t tick = 1; tick <= frames; ++tick) {
    moments.push_back(
        {tick, tick == 1 ? PacketKind::key : PacketKind::predicted, sampleMotion(layout, tick, 0.02f)});
  }
  return makeStream(name, layout, moments);
}

// Three qualities. The stream changes to the next one at each key frame.
GoldenStream makeQualityStream(const std::string& name, std::uint8_t codec) {
  StreamLayout layout = mixedLayout(NormalMode::octahedral, codec);
  layout.qualities = 3;
  std::vector<Moment> moments;
  for (std::uint64_t tick = 1; tick <= 9; ++tick) {
    const std::uint64_t sinceKey = (tick - 1) % 3;
    moments.push_back({tick, sinceKey == 0 ? PacketKind::key : PacketKind::predicted,
                       sampleMotion(layout, tick, 0.03f), static_cast<std::uint8_t>((tick - 1) / 3)});
  }
  return makeStream(name, layout, moments);
}

// Half of the cloth is held still and starts to rest.
GoldenStream makeHeldStream(const std::string& name, std::uint8_t codec) {
  const StreamLayout layout{
      .epoch = 9, .codec = codec, .cloths = {{.vertexCount = 144, .rows = 12, .columns = 12}}};
  const MotionFrame start = sampleMotion(layout, 1, 0.02f);
  std::vector<Moment> moments;
  for (std::uint64_t tick = 1; tick <= 8; ++tick) {
    MotionFrame frame = sampleMotion(layout, tick, 0.02f);
    std::copy_n(start.positions.begin(), frame.positions.size() / 2, frame.positions.begin());
    moments.push_back({tick, tick == 1 ? PacketKind::key : PacketKind::predicted, frame});
  }
  return makeStream(name, layout, moments);
}

// A mesh and a grid.
GoldenStream makeMeshStream(const std::string& name, std::uint8_t codec) {
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
  return makeStream(name, {.epoch = 9, .codec = codec, .cloths = {mesh.cloth(), grid}}, moments);
}

}  // namespace
}  // namespace clothstream::codec

int main() try {
  using namespace clothstream::codec;
  writeGoldenStreams(
      {makeStream("hierarchical", mixedLayout(NormalMode::none, kCodecHierarchical)),
       makeStream("hierarchical_normals", mixedLayout(NormalMode::octahedral, kCodecHierarchical)),
       makeMeshStream("mesh", kCodecHierarchical),
       makeStream("fine_hierarchical", {.epoch = 8,
                                        .codec = kCodecHierarchical,
                                        .maxError = 0.00002f,
                                        .normals = NormalMode::none,
                                        .cloths = {{.vertexCount = 150, .rows = 15, .columns = 10}}}),
       makeLongStream("weighted", {.epoch = 9,
                                   .codec = kCodecHierarchical,
                                   .cloths = {{.vertexCount = 400, .rows = 20, .columns = 20}}}),
       makeLongStream("layered", {.epoch = 9,
                                  .codec = kCodecHierarchical,
                                  .temporalLayers = 3,
                                  .cloths = {{.vertexCount = 400, .rows = 20, .columns = 20}}}),
       makeStream("vertex", {.epoch = 0xffffffffu,
                             .codec = kCodecHierarchical,
                             .maxError = 0.01f,
                             .normals = NormalMode::none,
                             .cloths = {{.vertexCount = 1, .rows = 0, .columns = 0}}}),
       makeStream("packed", mixedLayout(NormalMode::none, kCodecPacked)),
       makeStream("packed_normals", mixedLayout(NormalMode::octahedral, kCodecPacked)),
       makeMeshStream("packed_mesh", kCodecPacked), makeHeldStream("held", kCodecHierarchical),
       makeHeldStream("packed_held", kCodecPacked),
       makeLongStream("packed_layered", {.epoch = 9,
                                         .codec = kCodecPacked,
                                         .temporalLayers = 3,
                                         .cloths = {{.vertexCount = 400, .rows = 20, .columns = 20}}}),
       // Enough vertices for several groups.
       makeLongStream("packed_large",
                      {.epoch = 9,
                       .codec = kCodecPacked,
                       .maxError = 0.01f,
                       .cloths = {{.vertexCount = 2400, .rows = 60, .columns = 40}}},
                      3),
       makeQualityStream("qualities", kCodecHierarchical),
       makeQualityStream("packed_qualities", kCodecPacked)});
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
