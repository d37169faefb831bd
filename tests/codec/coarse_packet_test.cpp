// SPDX-License-Identifier: MIT
#include "proto/codec/coarse_packet.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"
#include "proto/codec/encoder.h"
#include "tests/codec/motion.h"

namespace clothstream::codec {
namespace {

constexpr std::uint32_t kRows = 61, kColumns = 45;

StreamLayout layoutWith(NormalMode normals) {
  return {.epoch = 3,
          .normals = normals,
          .cloths = {{.vertexCount = kRows * kColumns, .rows = kRows, .columns = kColumns},
                     {.vertexCount = 1},
                     {.vertexCount = 25}}};
}

// Every fourth vertex of every fourth row of the grid, and the last ones.
std::vector<std::uint32_t> coarseVertices() {
  std::vector<std::uint32_t> vertices;
  for (std::uint32_t row = 0; row < kRows; ++row) {
    for (std::uint32_t column = 0; column < kColumns; ++column) {
      const bool inRow = row % 4 == 0 || row + 1 == kRows,
                 inColumn = column % 4 == 0 || column + 1 == kColumns;
      if (inRow && inColumn) vertices.push_back(row * kColumns + column);
    }
  }
  return vertices;
}

double distance(const float* a, const float* b) {
  return std::hypot(static_cast<double>(a[0] - b[0]), static_cast<double>(a[1] - b[1]),
                    static_cast<double>(a[2] - b[2]));
}

class CoarsePacket : public testing::TestWithParam<StreamLayout> {};
INSTANTIATE_TEST_SUITE_P(Layouts, CoarsePacket,
                         testing::Values(layoutWith(NormalMode::none), layoutWith(NormalMode::octahedral)));

TEST_P(CoarsePacket, HoldsExactCoarseVertices) {
  const StreamLayout& layout = GetParam();
  const auto encoder = Encoder::make(layout);
  const auto full = Decoder::make(layout), coarse = Decoder::make(layout, Detail::coarse),
             ofWhole = Decoder::make(layout, Detail::coarse);
  std::vector<std::byte> packet(encoder->packetBound()), small(packet.size());
  std::size_t fullBytes = 0, coarseBytes = 0;
  for (std::uint64_t tick = 1; tick <= 40; ++tick) {
    // The cloth rests for a while.
    const MotionFrame frame = sampleMotion(layout, tick < 20 || tick > 30 ? tick : 20, 0.01f);
    const PacketKind kind = tick % 16 == 1 ? PacketKind::key : PacketKind::predicted;
    const std::size_t bytes = encoder->encode(tick, kind, frame.positions, frame.normals, packet);
    const std::span<const std::byte> whole = std::span(packet).first(bytes);
    const std::size_t smallBytes = makeCoarsePacket(whole, small);
    fullBytes += bytes;
    coarseBytes += smallBytes;
    ASSERT_EQ(full->decode(whole), DecodeResult::ok);
    ASSERT_EQ(coarse->decode(std::span(small).first(smallBytes)), DecodeResult::ok) << tick;
    ASSERT_EQ(ofWhole->decode(whole), DecodeResult::ok) << tick;
    EXPECT_EQ(coarse->reconstructionHash(), ofWhole->reconstructionHash());
    for (const std::uint32_t vertex : coarseVertices()) {
      for (std::size_t c = 0; c < 3; ++c)
        ASSERT_EQ(coarse->positions()[3 * vertex + c], full->positions()[3 * vertex + c]) << tick;
    }
    // Waves of 1 cm are followed to within half of that, also at borders.
    for (std::size_t i = 0; i < 3 * kRows * kColumns; i += 3)
      ASSERT_LT(distance(&coarse->positions()[i], &full->positions()[i]), 0.005) << tick << ' ' << i;
  }
  EXPECT_LT(2 * coarseBytes, fullBytes);
}

TEST(CoarsePackets, AreRefusedByAFullDecoder) {
  const StreamLayout layout = layoutWith(NormalMode::none);
  const auto encoder = Encoder::make(layout);
  const auto decoder = Decoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound());
  const MotionFrame frame = sampleMotion(layout, 1, 0.02f);
  const std::size_t bytes = encoder->encode(1, PacketKind::key, frame.positions, {}, packet);
  const std::vector<std::byte> whole(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(bytes));
  const std::size_t small = makeCoarsePacket(whole, packet);
  EXPECT_EQ(decoder->decode(std::span(packet).first(small)), DecodeResult::malformed);
  EXPECT_EQ(decoder->decode(whole), DecodeResult::ok);
}

TEST(CoarsePackets, AreMadeOnlyFromPacketsOfKnownCodecs) {
  const StreamLayout layout = layoutWith(NormalMode::none);
  const auto encoder = Encoder::make(layout);
  std::vector<std::byte> packet(encoder->packetBound()), out(packet.size());
  const MotionFrame frame = sampleMotion(layout, 1, 0.02f);
  const std::size_t bytes = encoder->encode(1, PacketKind::key, frame.positions, {}, packet);
  EXPECT_GT(makeCoarsePacket(std::span(packet).first(bytes), out), 0u);
  EXPECT_EQ(makeCoarsePacket(std::span(packet).first(bytes / 2), out), 0u);
  EXPECT_EQ(makeCoarsePacket({}, out), 0u);
  for (const std::byte codec : {std::byte{1}, std::byte{3}}) {
    packet[1] = codec;
    EXPECT_EQ(makeCoarsePacket(std::span(packet).first(bytes), out), 0u);
  }
}

}  // namespace
}  // namespace clothstream::codec
