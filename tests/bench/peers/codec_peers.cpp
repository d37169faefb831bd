// SPDX-License-Identifier: MIT
// Frames of the curtain at half a millimetre: Draco and meshoptimizer beside our codec's reference encoder.
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "server/scene/stability.h"
#include "tests/bench/hung_cloth.h"
#include "tests/bench/peers/peer_codecs.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/samples.h"
#include "tests/bench/simulated.h"

namespace clothstream::bench {
namespace {

constexpr std::uint32_t kFrames = 240;
constexpr float kMaxError = 0.0005f;

class OurCodec final : public PeerCodec {
 public:
  explicit OurCodec(const codec::StreamLayout& layout)
      : encoder_(codec::Encoder::make(layout)), decoder_(codec::Decoder::make(layout)) {}

  const char* name() const override { return "ClothStream codec 2"; }

  std::vector<std::byte> encode(std::span<const float> positions) override {
    std::vector<std::byte> packet(encoder_->packetBound());
    packet.resize(encoder_->encode(tick_++, codec::PacketKind::predicted, positions, {}, packet));
    return packet;
  }

  void decode(std::span<const std::byte> packet, std::span<float> positions) override {
    if (decoder_->decode(packet) != codec::DecodeResult::ok)
      throw std::runtime_error("our codec does not decode");
    std::ranges::copy(decoder_->positions(), positions.begin());
  }

 private:
  std::unique_ptr<codec::Encoder> encoder_;
  std::unique_ptr<codec::Decoder> decoder_;
  std::uint64_t tick_ = 0;
};

struct Measured {
  std::unique_ptr<PeerCodec> codec;
  bool keepsOrder;
  Samples encode, decode;
  double bytes = 0;
};

double largestError(std::span<const float> a, std::span<const float> b) {
  double largest = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    largest = std::max(largest, std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])));
  return largest;
}

}  // namespace

Rows compareCodecs(vulkan::Device& device) {
  scene::Scene scene = hungCloth(100);
  scene.substeps = std::max(scene.substeps, scene::stableSubsteps(scene));
  const scene::Grid& grid = scene.cloths.front().grid;
  Simulated simulated(device, scene, {});

  const PeerLattice lattice{{-4, -4, -4}, 2 * kMaxError, 13};
  std::vector<Measured> all;
  all.push_back({dracoMesh(grid.rows, grid.columns, lattice), false, {}, {}});
  all.push_back({meshoptimizerDelta(grid.nodeCount(), lattice, false), true, {}, {}});
  all.push_back({meshoptimizerDelta(grid.nodeCount(), lattice, true), true, {}, {}});
  all.push_back({std::make_unique<OurCodec>(
                     codec::StreamLayout{.epoch = 1,
                                         .codec = codec::kCodecHierarchical,
                                         .maxError = kMaxError,
                                         .cloths = {{grid.nodeCount(), grid.rows, grid.columns}}}),
                 true,
                 {},
                 {}});

  std::vector<float> positions(3 * grid.nodeCount()), decoded(positions.size());
  for (std::uint32_t frame = 0; frame < kFrames; ++frame) {
    simulated.tick(hungClothInputs(scene, frame));
    const simulation::NodeState state = simulated.state();
    for (std::size_t i = 0; i < state.positions.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        positions[3 * i + static_cast<std::size_t>(axis)] = state.positions[i][axis];
    for (Measured& one : all) {
      std::vector<std::byte> packet;
      one.encode.add(secondsOf([&] { packet = one.codec->encode(positions); }));
      one.decode.add(secondsOf([&] { one.codec->decode(packet, decoded); }));
      one.bytes += static_cast<double>(packet.size());
      // Half the diagonal of a cube of one step, and the rounding of coordinates of a few metres.
      if (one.keepsOrder && largestError(positions, decoded) > std::sqrt(3.0) * kMaxError + 1e-6)
        throw std::runtime_error(fmt::format("{} is off by {} m in frame {}", one.codec->name(),
                                             largestError(positions, decoded), frame));
    }
  }

  Rows rows;
  for (const Measured& one : all)
    rows.push_back({{"suite", "codec_peers"},
                    {"who", one.codec->name()},
                    {"vertices", grid.nodeCount()},
                    {"frames", kFrames},
                    {"bitsPerVertex", one.bytes * 8 / (static_cast<double>(grid.nodeCount()) * kFrames)},
                    {"encodeMsMedian", one.encode.median() * 1e3},
                    {"encodeMsP99", one.encode.p99() * 1e3},
                    {"decodeMsMedian", one.decode.median() * 1e3},
                    {"decodeMsP99", one.decode.p99() * 1e3}});
  return rows;
}

}  // namespace clothstream::bench
