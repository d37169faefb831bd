// SPDX-License-Identifier: MIT
// Any k of the data and parity pieces give all data pieces.
#include "proto/datagram/erasure_code.h"

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/datagram/frames.h"

namespace clothstream::datagram {
namespace {

// Data pieces, then parity pieces.
std::vector<Bytes> encode(const Bytes& data, unsigned count, unsigned parity) {
  const std::size_t bytes = data.size() / count;
  std::vector<Bytes> pieces(count + parity, Bytes(bytes));
  for (unsigned i = 0; i < count; ++i)
    std::copy_n(data.begin() + static_cast<int>(i * bytes), bytes, pieces[i].begin());
  for (unsigned row = 0; row < parity; ++row) makeParity(data, row, pieces[count + row]);
  return pieces;
}

// Returns what the pieces with these indices give.
Bytes recover(std::vector<Bytes> pieces, const std::vector<unsigned>& indices) {
  std::vector<CodedPiece> coded;
  for (const unsigned index : indices) coded.push_back({index, pieces[index]});
  Bytes data(indices.size() * pieces.front().size(), std::byte{0xee});
  recoverData(coded, data);
  return data;
}

TEST(ErasureCode, RecoversEveryPatternOfSmallFrames) {
  for (unsigned count = 1; count <= 4; ++count)
    for (unsigned parity = 0; parity <= 3; ++parity) {
      const Bytes data = testMessage(5 * count, count);
      const std::vector<Bytes> pieces = encode(data, count, parity);
      for (unsigned mask = 0; mask < 1u << (count + parity); ++mask) {
        std::vector<unsigned> indices;
        for (unsigned i = 0; i < count + parity; ++i)
          if ((mask >> i & 1) != 0) indices.push_back(i);
        if (indices.size() != count) continue;
        EXPECT_EQ(recover(pieces, indices), data) << count << " + " << parity << ", pieces " << mask;
        std::ranges::reverse(indices);
        EXPECT_EQ(recover(pieces, indices), data) << count << " + " << parity << ", reversed " << mask;
      }
    }
}

TEST(ErasureCode, RecoversRandomPatternsOfLargeFrames) {
  std::mt19937 random(7);
  for (const unsigned count : {7u, 33u, kMaxDataPieces}) {
    const Bytes data = testMessage(11 * count, count);
    const std::vector<Bytes> pieces = encode(data, count, kMaxParityPieces);
    std::vector<unsigned> indices(pieces.size());
    std::iota(indices.begin(), indices.end(), 0u);
    for (int i = 0; i < 10; ++i) {
      std::ranges::shuffle(indices, random);
      EXPECT_EQ(recover(pieces, {indices.begin(), indices.begin() + static_cast<int>(count)}), data);
    }
  }
}

TEST(ErasureCode, RecoversWithParityAlone) {
  const Bytes data = testMessage(kMaxParityPieces);
  std::vector<unsigned> indices(kMaxParityPieces);
  std::iota(indices.begin(), indices.end(), kMaxParityPieces);
  EXPECT_EQ(recover(encode(data, kMaxParityPieces, kMaxParityPieces), indices), data);
}

TEST(ErasureCode, ShortLastPieceCountsAsPadded) {
  Bytes data = testMessage(10);
  Bytes padded = data, parity(4), same(4);
  padded.resize(12);
  makeParity(data, 3, parity);
  makeParity(padded, 3, same);
  EXPECT_EQ(parity, same);
}

// Other implementations must make the same bytes.
TEST(ErasureCode, BytesAreThoseOfTheField) {
  // 1 / (255 ^ 0) = 0xfd and 1 / (255 ^ 1) = 0x7e with the polynomial 0x11d.
  const Bytes data{std::byte{1}, std::byte{0}, std::byte{0}, std::byte{1}};
  Bytes parity(2);
  makeParity(data, 0, parity);
  EXPECT_EQ(parity, (Bytes{std::byte{0xfd}, std::byte{0x7e}}));
}

}  // namespace
}  // namespace clothstream::datagram
