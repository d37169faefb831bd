// SPDX-License-Identifier: MIT
#include "proto/codec/packet_header.h"

#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::codec {
namespace {

constexpr std::uint64_t kLastTick = std::numeric_limits<std::uint64_t>::max();

PacketHeader largestHeader() {
  PacketHeader header;
  header.codec = 255;
  header.epoch = 0xffffffffu;
  header.kind = PacketKind::predicted;
  header.quality = 255;
  header.tick = kLastTick;
  header.referenceCount = kMaxReferences;
  header.references = {0, 1, kLastTick - 1, kLastTick - 200};
  header.rangeCount = kMaxClothRanges;
  for (std::uint32_t i = 0; i < kMaxClothRanges; ++i) header.ranges[i] = {i * 16'000'000u, 15'999'999u};
  header.sectionCount = kMaxSections;
  for (std::uint32_t i = 0; i < kMaxSections; ++i) header.sectionBytes[i] = 1u << (2 * i);
  return header;
}

PacketHeader smallHeader() {
  PacketHeader header;
  header.epoch = 3;
  header.kind = PacketKind::predicted;
  header.tick = 300;
  header.referenceCount = 1;
  header.references[0] = 299;
  header.rangeCount = 2;
  header.ranges[0] = {0, 2};
  header.ranges[1] = {5, 1};
  header.sectionCount = 2;
  header.sectionBytes = {3, 1};
  return header;
}

std::vector<std::byte> packetOf(const PacketHeader& header) {
  std::vector<std::byte> bytes(headerBound(header));
  std::size_t size = writeHeader(header, bytes);
  for (std::size_t i = 0; i < header.sectionCount; ++i) size += header.sectionBytes[i];
  bytes.resize(size);
  return bytes;
}

void expectEqual(const PacketHeader& a, const PacketHeader& b) {
  EXPECT_EQ(a.version, b.version);
  EXPECT_EQ(a.codec, b.codec);
  EXPECT_EQ(a.epoch, b.epoch);
  EXPECT_EQ(a.kind, b.kind);
  EXPECT_EQ(a.quality, b.quality);
  EXPECT_EQ(a.tick, b.tick);
  EXPECT_EQ(a.referenceCount, b.referenceCount);
  EXPECT_EQ(a.references, b.references);
  ASSERT_EQ(a.rangeCount, b.rangeCount);
  for (std::size_t i = 0; i < a.rangeCount; ++i) {
    EXPECT_EQ(a.ranges[i].first, b.ranges[i].first);
    EXPECT_EQ(a.ranges[i].count, b.ranges[i].count);
  }
  EXPECT_EQ(a.sectionCount, b.sectionCount);
  EXPECT_EQ(a.sectionBytes, b.sectionBytes);
}

TEST(PacketHeader, RoundTrips) {
  for (const PacketHeader& header : {smallHeader(), largestHeader()}) {
    const std::vector<std::byte> bytes = packetOf(header);
    const auto packet = parsePacket(bytes);
    ASSERT_TRUE(packet.has_value());
    expectEqual(packet->header, header);
    EXPECT_EQ(packet->body.data() + packet->body.size(), bytes.data() + bytes.size());
  }
}

TEST(PacketHeader, TakesFewBytes) {
  // 5 fixed, epoch, 2 of tick, reference count and distance, range count and 2 x 2, section count and 2.
  EXPECT_EQ(packetOf(smallHeader()).size(), 18u + 4u);
}

TEST(PacketHeader, RefusesEveryTruncation) {
  const std::vector<std::byte> bytes = packetOf(smallHeader());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    // Exactly sized, so that the address sanitizer detects a read past the end.
    const auto copy = std::make_unique<std::byte[]>(size);
    std::memcpy(copy.get(), bytes.data(), size);
    EXPECT_FALSE(parsePacket({copy.get(), size}).has_value()) << size;
  }
}

TEST(PacketHeader, RefusesBytesOutsideOfSections) {
  std::vector<std::byte> bytes = packetOf(smallHeader());
  bytes.push_back(std::byte{0});
  EXPECT_FALSE(parsePacket(bytes).has_value());
}

// Bytes of the small header: version, codec, kind, quality, reserved, epoch, tick (2), references (count,
// distance), ranges (count, gap, cloths, gap, cloths), sections (count, sizes).
struct Damage {
  const char* what;
  std::size_t at;
  std::uint8_t value;
};
TEST(PacketHeader, RefusesValuesOutOfRange) {
  const Damage damages[] = {
      {"another version", 0, 2},       {"an unknown kind", 2, 2},     {"references of a key frame", 2, 0},
      {"the reserved byte", 4, 1},     {"no reference", 8, 0},        {"five references", 8, 5},
      {"a reference to itself", 9, 0}, {"no range", 10, 0},           {"an empty range", 12, 0},
      {"nine sections", 15, 9},        {"a section too long", 16, 4}, {"a section too short", 16, 2}};
  const std::vector<std::byte> bytes = packetOf(smallHeader());
  ASSERT_TRUE(parsePacket(bytes).has_value());
  for (const Damage& damage : damages) {
    std::vector<std::byte> damaged = bytes;
    damaged[damage.at] = std::byte{damage.value};
    EXPECT_FALSE(parsePacket(damaged).has_value()) << damage.what;
  }
}

TEST(PacketHeader, RefusesLongFormsOfNumbers) {
  std::vector<std::byte> bytes = packetOf(smallHeader());
  bytes[5] = std::byte{0x83};  // epoch 3 in two bytes
  bytes.insert(bytes.begin() + 6, std::byte{0});
  EXPECT_FALSE(parsePacket(bytes).has_value());
}

TEST(PacketHeader, RefusesRangesBeyondThirtyTwoBits) {
  PacketHeader header = smallHeader();
  header.ranges[0] = {0xfffffff0u, 0xfu};
  header.rangeCount = 1;
  std::vector<std::byte> bytes = packetOf(header);
  ASSERT_TRUE(parsePacket(bytes).has_value());
  bytes[16] = std::byte{0x10};  // the count
  EXPECT_FALSE(parsePacket(bytes).has_value());
}

}  // namespace
}  // namespace clothstream::codec
