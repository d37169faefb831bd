// SPDX-License-Identifier: MIT
// Decodes the golden packets with the client.
#include "tests/codec/golden.h"

#include <gtest/gtest.h>

#include "tests/core/sessions.h"

namespace clothstream::client {
namespace {

TEST(Golden, PacketsDecodeToRecordedHashes) {
  const auto streams = codec::readGoldenStreams();
  ASSERT_FALSE(streams.empty());
  for (const codec::GoldenStream& stream : streams) {
    const std::vector<Observation> seen = replay(goldenSession(stream.name));
    const std::size_t packets = stream.packets.size() + stream.refused.size();
    ASSERT_GT(seen.size(), packets);
    for (std::size_t i = 0; i < stream.packets.size(); ++i) {
      const codec::GoldenPacket& packet = stream.packets[i];
      const Observation& after = seen[seen.size() - packets + i];
      EXPECT_EQ(after.events, static_cast<std::uint32_t>(CS_EVENT_FRAME)) << packet.file;
      EXPECT_EQ(after.tick, packet.tick) << packet.file;
      EXPECT_EQ(after.reconstructionHash, packet.reconstructionHash) << packet.file;
      EXPECT_EQ(after.positionsHash, packet.positionsHash) << packet.file;
    }
    for (std::size_t i = 0; i < stream.refused.size(); ++i) {
      const Observation& after = seen[seen.size() - stream.refused.size() + i];
      EXPECT_EQ(after.decodeErrors, i + 1) << stream.refused[i].file;
      EXPECT_EQ(after.reconstructionHash, stream.packets.back().reconstructionHash) << stream.refused[i].file;
    }
  }
}

TEST(Golden, SessionsRepeatBitForBit) {
  for (const Session& session : recordedSessions())
    EXPECT_EQ(replay(session), replay(session)) << session.name;
}

}  // namespace
}  // namespace clothstream::client
