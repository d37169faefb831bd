// SPDX-License-Identifier: MIT
// Threads change how long a frame takes, and nothing else.
#include "server/encode/worker_threads.h"

#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/encoder.h"
#include "tests/codec/cut_grid.h"
#include "tests/codec/motion.h"

namespace clothstream::encode {
namespace {

using codec::NormalMode;
using codec::PacketKind;
using codec::StreamLayout;

struct Packet {
  std::vector<std::byte> bytes;
  std::uint64_t reconstructionHash;
  bool operator==(const Packet&) const = default;
};
using Packets = std::vector<Packet>;

// Packets of frames, some of which are key frames.
Packets packetsOf(const StreamLayout& layout, std::uint32_t weightLag, codec::Workers* workers) {
  const auto encoder = codec::Encoder::make(layout, {.weightLag = weightLag, .workers = workers});
  std::vector<std::byte> packet(encoder->packetBound());
  Packets packets;
  for (std::uint64_t tick = 1; tick <= 9; ++tick) {
    const codec::MotionFrame frame = codec::sampleMotion(layout, tick, 0.1f);
    const PacketKind kind = tick % 6 == 1 ? PacketKind::key : PacketKind::predicted;
    const std::size_t bytes = encoder->encode(tick, kind, frame.positions, frame.normals, packet);
    packets.push_back({{packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(bytes)},
                       encoder->reconstructionHash()});
  }
  return packets;
}

void expectTheSamePackets(const StreamLayout& layout, std::uint32_t weightLag = 0) {
  const Packets alone = packetsOf(layout, weightLag, nullptr);
  for (const std::uint32_t count : {1u, 2u, 3u, 8u}) {
    WorkerThreads threads(count);
    EXPECT_EQ(packetsOf(layout, weightLag, &threads), alone) << count << " threads";
  }
}

// Several batches of the finest level, and some cloths that are small.
StreamLayout largeLayout() {
  return {.epoch = 1,
          .maxError = 0.0005f,
          .cloths = {{200 * 190, 200, 190}, {7 * 9, 7, 9}, {60 * 50, 60, 50}, {1, 1, 1}}};
}

TEST(WorkerThreads, MakeTheSamePacketsAsOneThread) {
  expectTheSamePackets(largeLayout());
}

TEST(WorkerThreads, MakeTheSamePacketsWithNormalsAndLag) {
  StreamLayout layout = largeLayout();
  layout.normals = NormalMode::octahedral;
  expectTheSamePackets(layout, 3);
}

TEST(WorkerThreads, MakeTheSamePacketsOfAMesh) {
  const codec::CutGrid cut(90);
  expectTheSamePackets({.epoch = 1, .maxError = 0.0005f, .cloths = {cut.cloth()}});
}

TEST(WorkerThreads, RunEachPieceOnceForSeveralCallers) {
  WorkerThreads threads(3);
  std::atomic<std::uint32_t> wrong = 0;
  const auto call = [&] {
    for (std::uint32_t pieces = 0; pieces < 200; ++pieces) {
      std::vector<std::uint32_t> done(pieces);
      threads.run(pieces, [&](std::uint32_t i) { ++done[i]; });
      wrong += std::ranges::count(done, 1u) == pieces ? 0 : 1;
    }
  };
  std::vector<std::thread> callers;
  for (int i = 0; i < 3; ++i) callers.emplace_back(call);
  for (std::thread& caller : callers) caller.join();
  EXPECT_EQ(wrong, 0u);
}

TEST(WorkerThreads, NumberAQuarterOfTheProcessors) {
  EXPECT_EQ(WorkerThreads::suitedTo(0), 1u);
  EXPECT_EQ(WorkerThreads::suitedTo(2), 1u);
  EXPECT_EQ(WorkerThreads::suitedTo(16), 4u);
  EXPECT_EQ(WorkerThreads::suitedTo(128), 8u);
}

}  // namespace
}  // namespace clothstream::encode
