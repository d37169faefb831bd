// SPDX-License-Identifier: MIT
#include "proto/codec/hierarchical/packed_blocks.h"

#include <algorithm>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

// Numbers of one group of vertices, and their bytes.
struct Group {
  std::array<std::vector<std::uint32_t>, 3> numbers;

  explicit Group(std::size_t count) { numbers.fill(std::vector<std::uint32_t>(count)); }
  std::size_t count() const { return numbers[0].size(); }

  std::vector<std::byte> written() const {
    std::vector<std::byte> bytes(groupsBound(3, count()));
    BitWriter out(bytes.data());
    writeGroup({.components = {numbers[0].data(), numbers[1].data(), numbers[2].data()},
                .count = count(),
                .hasStays = true},
               out);
    const std::size_t size = out.bytesSince(bytes.data());
    EXPECT_LE(size, bytes.size());
    bytes.resize(size);
    return bytes;
  }
};

// Destinations start with 77 everywhere.
struct Read {
  std::array<std::vector<std::int32_t>, 3> residuals;
  std::vector<std::uint8_t> stays;
  bool isWhole = false;

  Read(std::span<const std::byte> bytes, std::size_t count) : stays(count, 77) {
    residuals.fill(std::vector<std::int32_t>(count, 77));
    BitReader in(bytes);
    isWhole = readGroup(in, {.components = {residuals[0].data(), residuals[1].data(), residuals[2].data()},
                             .stays = stays.data(),
                             .count = count}) &&
              in.atEnd();
  }
};

void expectReadBack(const Group& group) {
  const std::vector<std::byte> bytes = group.written();
  const Read read(bytes, group.count());
  ASSERT_TRUE(read.isWhole);
  for (std::size_t i = 0; i < group.count(); ++i) {
    const bool stays = group.numbers[0][i] == kStayNumber;
    EXPECT_EQ(read.stays[i], stays ? 1 : 0) << i;
    for (std::size_t c = 0; c < 3; ++c)
      ASSERT_EQ(read.residuals[c][i], stays && c == 0 ? 0 : unzigzag(group.numbers[c][i])) << c << ' ' << i;
  }
}

// Random numbers of at most `mostBits` bits, mostly zero if `sparse`.
Group anyGroup(std::mt19937& random, std::size_t count, unsigned mostBits, bool sparse) {
  Group group(count);
  for (auto& component : group.numbers)
    for (std::uint32_t& number : component)
      if (!sparse || random() % 9 == 0)
        number = static_cast<std::uint32_t>(random()) >> (31 - random() % mostBits);
  return group;
}

TEST(PackedBlocks, ReadBackAnyNumbers) {
  std::mt19937 random(1);
  for (const std::size_t count : {1u, 3u, 31u, 32u, 33u, 200u, 2047u, 2048u}) {
    for (const unsigned mostBits : {1u, 3u, 8u, 17u, 29u, 31u}) {
      for (const bool sparse : {false, true}) {
        Group group = anyGroup(random, count, mostBits, sparse);
        expectReadBack(group);
        group.numbers[0][random() % count] = kStayNumber;
        expectReadBack(group);
      }
    }
  }
}

TEST(PackedBlocks, KeepTheirBoundForLargeNumbersAndChangingModes) {
  Group large(2048), changing(2048);
  for (std::size_t i = 0; i < large.count(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      large.numbers[c][i] = 0x7fffffffu;
      changing.numbers[c][i] = i / kBlockVertices % 2 == 0 ? 0x7fffffffu : 0;
    }
  }
  expectReadBack(large);
  expectReadBack(changing);
}

TEST(PackedBlocks, TakeOneByteIfAllNumbersAreZero) {
  EXPECT_EQ(Group(2048).written(), std::vector{std::byte{1}});
}

TEST(PackedBlocks, TakeFewBitsForSmallNumbers) {
  std::mt19937 random(2);
  Group group(2048);
  for (auto& component : group.numbers)
    for (std::uint32_t& number : component) number = random() % 8 == 0 ? 1 : 0;
  // Each number has 0.54 bits of entropy.
  EXPECT_LT(10 * 8 * group.written().size(), 3 * 2048 * 9);
}

TEST(PackedBlocks, RefuseEveryTruncation) {
  std::mt19937 random(3);
  const Group group = anyGroup(random, 100, 9, false);
  const std::vector<std::byte> bytes = group.written();
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    // Exactly sized, so that the address sanitizer detects a read past the end.
    const auto copy = std::make_unique<std::byte[]>(size);
    std::copy_n(bytes.begin(), size, copy.get());
    EXPECT_FALSE(Read({copy.get(), size}, group.count()).isWhole) << size;
  }
}

TEST(PackedBlocks, RefuseUnknownModesAndLeftoverBits) {
  std::array<std::byte, 16> bytes{};
  BitWriter out(bytes.data());
  out.put(0, 1);
  out.put((1u << 15) - 1, 15);  // the first mode is 32
  out.putGamma(zigzag(kModes) - 15, 2);
  out.finish();
  BitReader in(bytes);
  std::array<std::int32_t, 4> residuals;
  EXPECT_FALSE(readGroup(in, {.components = {residuals.data()}, .count = residuals.size()}));
  EXPECT_FALSE(Read(std::array{std::byte{3}}, 4).isWhole);
  EXPECT_TRUE(Read(std::array{std::byte{1}}, 4).isWhole);
}

}  // namespace
}  // namespace clothstream::codec::hierarchical
