// SPDX-License-Identifier: MIT
#include "tests/codec/golden.h"

#include <gtest/gtest.h>

#include "proto/codec/decoder.h"

namespace clothstream::codec {
namespace {

TEST(GoldenPackets, AreDecodedToTheSameBitsForEver) {
  const std::vector<GoldenStream> streams = readGoldenStreams();
  ASSERT_FALSE(streams.empty());
  for (const GoldenStream& stream : streams) {
    const auto decoder = Decoder::make(stream.layout);
    ASSERT_NE(decoder, nullptr) << stream.name;
    ASSERT_FALSE(stream.packets.empty());
    for (const GoldenPacket& packet : stream.packets) {
      ASSERT_EQ(decoder->decode(packet.bytes), DecodeResult::ok) << packet.file;
      EXPECT_EQ(decoder->tick(), packet.tick);
      EXPECT_EQ(parsePacket(packet.bytes)->header.kind, packet.kind);
      EXPECT_EQ(decoder->reconstructionHash(), packet.reconstructionHash) << packet.file;
      EXPECT_EQ(hashFloats(decoder->positions()), packet.positionsHash) << packet.file;
    }
  }
}

}  // namespace
}  // namespace clothstream::codec
