// SPDX-License-Identifier: MIT
#include "proto/sctp/chunks.h"

#include <random>

#include <gtest/gtest.h>

#include "proto/sctp/crc32c.h"
#include "tests/sctp/bytes.h"

namespace clothstream::sctp {
namespace {

constexpr std::uint32_t kTag = 0x01020304;

TEST(Crc32c, MatchesPublishedValues) {
  EXPECT_EQ(crc32c(bytesOf("123456789")), 0xe3069283u);
  EXPECT_EQ(crc32c(Bytes(32)), 0x8a9136aau);  // RFC 3720, appendix B.4
  EXPECT_EQ(crc32c(Bytes(32, std::byte{0xff})), 0x62a8ab43u);
  EXPECT_EQ(crc32c(bytesOf("789"), crc32c(bytesOf("123456"))), 0xe3069283u);
}

TEST(Chunks, WriteInitAsTheRfcSays) {
  const Init init{.tag = kTag,
                  .window = 0x20000,
                  .outgoingStreams = 1024,
                  .incomingStreams = 1025,
                  .tsn = 0xfffefdfc,
                  .forwardTsn = true,
                  .reconfig = true,
                  .zeroChecksum = true};
  Bytes value(initBytes(init));
  writeInit(value, init);
  EXPECT_EQ(value, join({bytesOf({1, 2, 3, 4, 0, 2, 0, 0, 4, 0, 4, 1, 0xff, 0xfe, 0xfd, 0xfc}),
                         bytesOf({0xc0, 0, 0, 4}), bytesOf({0x80, 8, 0, 6, 130, 192, 0, 0}),
                         bytesOf({0x80, 1, 0, 8, 0, 0, 0, 1})}));
}

TEST(Chunks, ReadInitAgain) {
  const Bytes cookie = bytesOf({9, 8, 7}), odd = bytesOf({0xc1, 0x23, 0, 5, 1});
  Init init{.tag = kTag,
            .window = 131072,
            .outgoingStreams = 1,
            .incomingStreams = 65535,
            .tsn = 7,
            .forwardTsn = true,
            .reconfig = true,
            .zeroChecksum = true,
            .cookie = cookie};
  init.unrecognized[0] = odd;
  const Bytes packet = packetOf(0, ChunkType::initAck, init);
  const std::vector<Chunk> chunks = chunksOf(packet);
  ASSERT_EQ(chunks.size(), 1u);
  const auto read = parseInit(chunks[0]);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->tag, kTag);
  EXPECT_EQ(read->window, 131072u);
  EXPECT_EQ(read->outgoingStreams, 1);
  EXPECT_EQ(read->incomingStreams, 65535);
  EXPECT_EQ(read->tsn, 7u);
  EXPECT_TRUE(read->forwardTsn && read->reconfig && read->zeroChecksum);
  EXPECT_TRUE(std::ranges::equal(read->cookie, cookie));
}

Chunk initWith(Bytes& storage, const Bytes& parameters) {
  storage = join({bytesOf({0, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 0, 0, 0, 0}), parameters});
  return {ChunkType::init, 0, storage, storage};
}

TEST(Chunks, ActionBitsOfParametersCount) {
  const Bytes forwardTsn = bytesOf({0xc0, 0, 0, 4});
  Bytes storage;
  // Skip; skip and report; stop; stop and report.
  const auto skip = parseInit(initWith(storage, join({bytesOf({0x9f, 1, 0, 4}), forwardTsn})));
  EXPECT_TRUE(skip && skip->forwardTsn && skip->unrecognized[0].empty());
  const auto report = parseInit(initWith(storage, join({bytesOf({0xdf, 1, 0, 4}), forwardTsn})));
  EXPECT_TRUE(report && report->forwardTsn && report->unrecognized[0].size() == 4);
  const auto stop = parseInit(initWith(storage, join({bytesOf({0x1f, 1, 0, 4}), forwardTsn})));
  EXPECT_TRUE(stop && !stop->forwardTsn && stop->unrecognized[0].empty());
  const auto both = parseInit(initWith(storage, join({bytesOf({0x5f, 1, 0, 4}), forwardTsn})));
  EXPECT_TRUE(both && !both->forwardTsn && both->unrecognized[0].size() == 4);
  // Addresses are known and ignored.
  const auto address = parseInit(initWith(storage, join({bytesOf({0, 5, 0, 8, 1, 2, 3, 4}), forwardTsn})));
  EXPECT_TRUE(address && address->forwardTsn);
}

TEST(Chunks, FewUnrecognizedParametersAreKept) {
  Bytes parameters;
  for (unsigned i = 0; i < 6; ++i) parameters = join({parameters, bytesOf({0xdf, i, 0, 4})});
  Bytes storage;
  EXPECT_EQ(parseInit(initWith(storage, parameters))->unrecognized[3][1], std::byte{3});
  EXPECT_TRUE(
      parseInit(initWith(storage, join({bytesOf({0xdf, 1, 0, 100}), Bytes(96)})))->unrecognized[0].empty());
}

TEST(Chunks, BadInitIsRefused) {
  Bytes storage;
  EXPECT_TRUE(parseInit(initWith(storage, {})));
  for (const std::size_t zero : {3u, 9u, 11u}) {  // tag, outgoing and incoming streams
    const Chunk chunk = initWith(storage, {});
    storage[zero] = std::byte{0};
    EXPECT_FALSE(parseInit(chunk)) << zero;
  }
  for (std::size_t size = 0; size < 16; ++size) {
    Chunk chunk = initWith(storage, {});
    chunk.value = chunk.value.first(size);
    EXPECT_FALSE(parseInit(chunk));
  }
  EXPECT_FALSE(parseInit(initWith(storage, bytesOf({0xc0, 0, 0, 3}))));
  EXPECT_FALSE(parseInit(initWith(storage, bytesOf({0xc0, 0, 0, 9, 1, 2, 3, 4}))));
  EXPECT_FALSE(parseInit(initWith(storage, bytesOf({0xc0, 0}))));
}

TEST(Chunks, ReadDataAgain) {
  for (const bool unordered : {false, true}) {
    for (const bool sackNow : {false, true}) {
      const Data data{.tsn = 0xffffffff,
                      .stream = 0x1234,
                      .protocol = 53,
                      .unordered = unordered,
                      .sackNow = sackNow,
                      .payload = bytesOf("hello")};
      const Bytes packet = packetOf(kTag, data);
      EXPECT_EQ(packet.size(), 12u + 16 + 8);
      const auto read = parseData(chunksOf(packet).at(0));
      ASSERT_TRUE(read);
      EXPECT_EQ(read->tsn, data.tsn);
      EXPECT_EQ(read->stream, data.stream);
      EXPECT_EQ(read->protocol, 53u);
      EXPECT_EQ(read->unordered, unordered);
      EXPECT_EQ(read->sackNow, sackNow);
      EXPECT_FALSE(read->fragment);
      EXPECT_TRUE(std::ranges::equal(read->payload, data.payload));
    }
  }
}

TEST(Chunks, FragmentsAreSeen) {
  const Bytes value(13);
  for (std::uint8_t flags = 0; flags < 3; ++flags)
    EXPECT_TRUE(parseData({ChunkType::data, flags, value, value})->fragment);
  EXPECT_FALSE(parseData({ChunkType::data, 3, value, value})->fragment);
  EXPECT_FALSE(parseData({ChunkType::data, 3, std::span(value).first(11), value}));
}

TEST(Chunks, ReadSackAgain) {
  const std::array<GapBlock, 2> gaps{{{2, 3}, {5, 9}}};
  const Bytes packet = sackPacket(kTag, 0xfffffffe, 5000, gaps);
  const auto sack = parseSack(chunksOf(packet).at(0));
  ASSERT_TRUE(sack);
  EXPECT_EQ(sack->cumulative, 0xfffffffeu);
  EXPECT_EQ(sack->window, 5000u);
  EXPECT_EQ(sack->highest, 7u);
}

TEST(Chunks, BadSackIsRefused) {
  const auto parse = [](const Bytes& value) { return parseSack({ChunkType::sack, 0, value, value}); };
  const Bytes head = bytesOf({0, 0, 0, 1, 0, 0, 0, 9});
  EXPECT_TRUE(parse(join({head, bytesOf({0, 0, 0, 0})})));
  EXPECT_TRUE(parse(join({head, bytesOf({0, 1, 0, 1, 0, 2, 0, 2, 0, 0, 0, 7})})));
  EXPECT_FALSE(parse(join({head, bytesOf({0, 0, 0})})));
  EXPECT_FALSE(parse(join({head, bytesOf({0, 1, 0, 0, 0, 2, 0})})));
  EXPECT_FALSE(parse(join({head, bytesOf({0, 0, 0, 1, 0, 0, 0})})));
  EXPECT_FALSE(parse(join({head, bytesOf({255, 255, 255, 255})})));
  EXPECT_FALSE(parse(join({head, bytesOf({0, 1, 0, 0, 0, 0, 0, 2})})));  // begins at the cumulative TSN
  EXPECT_FALSE(parse(join({head, bytesOf({0, 1, 0, 0, 0, 3, 0, 2})})));  // ends before it begins
}

TEST(Packet, ZeroOrRightChecksumIsAccepted) {
  Bytes packet = packetOf(kTag, {.tsn = 1, .stream = 0, .protocol = 53, .payload = bytesOf("hello")});
  ASSERT_TRUE(parsePacket(packet));
  EXPECT_EQ(parsePacket(packet)->tag, kTag);
  for (std::size_t bit = 0; bit < 8 * packet.size(); ++bit) {
    Bytes damaged = packet;
    damaged[bit / 8] ^= static_cast<std::byte>(1 << bit % 8);
    EXPECT_FALSE(parsePacket(damaged)) << bit;
  }
  std::fill_n(packet.begin() + 8, 4, std::byte{0});
  EXPECT_TRUE(parsePacket(packet));
}

TEST(Packet, BadSizesAreRefused) {
  const Bytes packet = packetOf(kTag, {.tsn = 1, .stream = 0, .protocol = 53, .payload = bytesOf("hello")});
  for (std::size_t size = 0; size < packet.size(); ++size)
    EXPECT_FALSE(parsePacket(Bytes(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(size))));
  Bytes large(kMaxReceivedBytes + 4);
  std::ranges::copy(std::span(packet).first(8), large.begin());
  EXPECT_FALSE(parsePacket(large));
  large.resize(kMaxReceivedBytes);
  EXPECT_TRUE(parsePacket(large));
}

TEST(Packet, OtherPortsAreRefused) {
  PacketWriter writer;
  writer.start(kTag);
  writer.add(ChunkType::cookieAck, 0, 0);
  const auto written = writer.finish(true);
  for (const std::size_t port : {1u, 3u}) {
    Bytes packet(written.begin(), written.end());
    packet[port] ^= std::byte{1};
    EXPECT_FALSE(parsePacket(packet));
  }
}

TEST(Packet, DamagedLengthsEndReading) {
  for (const auto& bytes :
       {bytesOf({11, 0, 0, 3}), bytesOf({11, 0, 0, 5}), bytesOf({11, 0, 0}), bytesOf({})}) {
    std::span<const std::byte> rest = bytes;
    EXPECT_FALSE(takeChunk(rest));
    rest = bytes;
    EXPECT_FALSE(takeParameter(rest));
  }
}

TEST(Packet, WriterFillsOnePacketExactly) {
  PacketWriter writer;
  EXPECT_TRUE(writer.empty());
  EXPECT_TRUE(writer.fits(kMaxSentBytes - 16));
  EXPECT_FALSE(writer.fits(kMaxSentBytes - 15));
  writer.start(kTag);
  writer.add(ChunkType::heartbeat, 0, 1);
  writer.add(ChunkType::heartbeatAck, 0, kMaxSentBytes - 24);
  EXPECT_FALSE(writer.fits(0));
  const auto packet = writer.finish(false);
  EXPECT_EQ(packet.size(), kMaxSentBytes);
  EXPECT_TRUE(parsePacket(packet));
  EXPECT_EQ(chunksOf(packet).at(0).value.size(), 1u);
  EXPECT_TRUE(writer.empty());
}

TEST(Packet, LargestMessageFits) {
  const Bytes payload(kMaxPayloadBytes);
  EXPECT_TRUE(PacketWriter().fits(dataBytes({.payload = payload})));
}

TEST(Packet, RandomBytesAreReadSafely) {
  std::mt19937 random(1);
  for (int i = 0; i < 20'000; ++i) {
    Bytes packet(16 + 4 * (random() % 20));
    for (std::byte& byte : packet)
      byte = static_cast<std::byte>(random() % 4 == 0 ? random() % 256 : random() % 12);
    std::ranges::copy(bytesOf({0x13, 0x88, 0x13, 0x88, 0, 0, 0, 1, 0, 0, 0, 0}), packet.begin());
    for (const Chunk& chunk : chunksOf(packet)) {
      static_cast<void>(parseInit(chunk));
      static_cast<void>(parseData(chunk));
      static_cast<void>(parseSack(chunk));
    }
  }
}

}  // namespace
}  // namespace clothstream::sctp
