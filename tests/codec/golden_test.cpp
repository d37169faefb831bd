// SPDX-License-Identifier: MIT
#include "tests/codec/golden.h"

#include <cmath>

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"

namespace clothstream::codec {
namespace {

// Normals are exact with float32 arithmetic. The tolerance allows for compilers that compute with more
// precision.
constexpr double kNormalTolerance = 2 / kNormalSteps;

TEST(GoldenPackets, DecodeToTheSameBitsForever) {
  const std::vector<GoldenStream> streams = readGoldenStreams();
  ASSERT_FALSE(streams.empty());
  for (const GoldenStream& stream : streams) {
    const auto decoder = Decoder::make(stream.layout);
    const auto coarse = Decoder::make(stream.layout, Detail::coarse);
    ASSERT_NE(decoder, nullptr) << stream.name;
    ASSERT_NE(coarse, nullptr) << stream.name;
    ASSERT_FALSE(stream.packets.empty());
    for (const GoldenPacket& packet : stream.packets) {
      ASSERT_EQ(decoder->decode(packet.bytes), DecodeResult::ok) << packet.file;
      EXPECT_EQ(decoder->tick(), packet.tick);
      EXPECT_EQ(parsePacket(packet.bytes)->header.kind, packet.kind);
      EXPECT_EQ(decoder->reconstructionHash(), packet.reconstructionHash) << packet.file;
      EXPECT_EQ(hashFloats(decoder->positions()), packet.positionsHash) << packet.file;
      std::vector<std::byte> smaller(packet.bytes.size());
      smaller.resize(makeCoarsePacket(packet.bytes, smaller));
      ASSERT_EQ(coarse->decode(smaller), DecodeResult::ok) << packet.file;
      EXPECT_EQ(hashFloats(coarse->positions()), packet.coarsePositionsHash) << packet.file;
    }
    for (const GoldenRefusal& refused : stream.refused) {
      EXPECT_EQ(decoder->decode(refused.bytes), DecodeResult::malformed) << refused.file;
      EXPECT_EQ(decoder->reconstructionHash(), stream.packets.back().reconstructionHash) << refused.file;
    }
    ASSERT_FALSE(stream.normals.empty()) << stream.name;
    for (const GoldenNormal& normal : stream.normals) {
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(double{decoder->normals()[3 * normal.vertex + c]}, normal.xyz[c], kNormalTolerance)
            << stream.name << ' ' << normal.vertex;
      }
    }
  }
}

}  // namespace
}  // namespace clothstream::codec
