// SPDX-License-Identifier: MIT
// Datagrams of pieces, and what is refused.
#include "proto/datagram/piece.h"

#include <array>

#include <gtest/gtest.h>

#include "tests/datagram/frames.h"

namespace clothstream::datagram {
namespace {

constexpr PiecePrefix kPrefix{.packet = 0x01020304, .sentUs = 0x05060708, .frame = 0x090a0b0c};

TEST(Piece, HasTheStatedBytes) {
  const Bytes message{std::byte{0xa0}, std::byte{0xa1}, std::byte{0xa2}};
  const FramePieces frame(std::make_shared<const Bytes>(message), 0);
  const Bytes datagram = datagramOf(frame, kPrefix, 0);
  const std::array<int, 22> expected{1,  4, 3, 2, 1, 8, 7, 6, 5,    12,   11,
                                     10, 9, 0, 1, 3, 0, 0, 0, 0xa0, 0xa1, 0xa2};
  ASSERT_EQ(datagram.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(std::to_integer<int>(datagram[i]), expected[i]) << i;
}

TEST(Piece, ReadsWhatItWrites) {
  for (const std::size_t bytes :
       {std::size_t{1}, kMaxPayloadBytes, kMaxPayloadBytes + 1, std::size_t{7300}, kMaxFrameBytes}) {
    const auto frame = testFrame(bytes, 2);
    EXPECT_EQ(frame->pieces(), frame->dataPieces() + 2);
    const Bytes message = testMessage(bytes);
    for (unsigned index = 0; index < frame->pieces(); ++index) {
      const Bytes datagram = datagramOf(*frame, kPrefix, index);
      EXPECT_EQ(datagram.size(), frame->datagramBytes());
      const auto piece = parsePiece(datagram);
      ASSERT_TRUE(piece) << bytes << " bytes, piece " << index;
      EXPECT_EQ(piece->prefix.packet, kPrefix.packet);
      EXPECT_EQ(piece->prefix.sentUs, kPrefix.sentUs);
      EXPECT_EQ(piece->prefix.frame, kPrefix.frame);
      EXPECT_EQ(piece->index, index);
      EXPECT_EQ(piece->dataPieces, frame->dataPieces());
      EXPECT_EQ(piece->frameBytes, bytes);
    }
    const Bytes last = datagramOf(*frame, kPrefix, frame->dataPieces() - 1);
    const auto piece = parsePiece(last);
    const std::size_t begin = (frame->dataPieces() - 1) * piece->payload.size();
    EXPECT_TRUE(equal(piece->payload.first(bytes - begin), std::span(message).subspan(begin)));
    for (const std::byte padding : piece->payload.subspan(bytes - begin)) EXPECT_EQ(padding, std::byte{});
  }
}

TEST(Piece, LargestDatagramIsFull) {
  EXPECT_EQ(testFrame(kMaxFrameBytes, 0)->datagramBytes(), kMaxDatagramBytes);
  EXPECT_TRUE(FramePieces::fits(kMaxFrameBytes));
  EXPECT_FALSE(FramePieces::fits(kMaxFrameBytes + 1));
  EXPECT_FALSE(FramePieces::fits(0));
}

TEST(Piece, RefusesEveryOtherLength) {
  Bytes datagram = datagramOf(*testFrame(2400, 1), kPrefix, 1);
  for (std::size_t bytes = 0; bytes < datagram.size(); ++bytes)
    EXPECT_FALSE(parsePiece(Bytes(datagram.begin(), datagram.begin() + static_cast<int>(bytes)))) << bytes;
  datagram.push_back({});
  EXPECT_FALSE(parsePiece(datagram));
}

TEST(Piece, RefusesImpossibleFields) {
  const Bytes good = datagramOf(*testFrame(2400, 1), kPrefix, 1);
  const auto accepts = [&](std::size_t at, int value) {
    Bytes datagram = good;
    datagram[at] = static_cast<std::byte>(value);
    return parsePiece(datagram).has_value();
  };
  EXPECT_TRUE(accepts(13, 34));
  EXPECT_FALSE(accepts(13, 35));  // index beyond 3 data and 32 parity pieces
  EXPECT_FALSE(accepts(14, 0));   // no data pieces
  EXPECT_FALSE(accepts(14, 129));
  EXPECT_FALSE(accepts(14, 4));  // pieces would be shorter
  EXPECT_FALSE(accepts(17, 1));  // frame of 67,936 bytes
  EXPECT_FALSE(accepts(18, 0xff));
  EXPECT_FALSE(accepts(0, 2));
}

TEST(Piece, RefusesPiecesOfPaddingAlone) {
  // Two bytes as three pieces, and five bytes as four.
  for (const auto& [bytes, count, payload] :
       {std::array{2, 3, 1}, std::array{5, 4, 2}, std::array{0, 1, 0}}) {
    Bytes datagram(kPieceHeaderBytes + static_cast<std::size_t>(payload));
    datagram[0] = std::byte{1};
    datagram[14] = static_cast<std::byte>(count);
    datagram[15] = static_cast<std::byte>(bytes);
    EXPECT_FALSE(parsePiece(datagram)) << bytes << " bytes, " << count << " pieces";
  }
}

TEST(Datagram, KnowsItsKinds) {
  for (int kind = 0; kind < 256; ++kind)
    EXPECT_EQ(kindOf(Bytes{static_cast<std::byte>(kind)}).has_value(), kind >= 1 && kind <= 4) << kind;
  EXPECT_FALSE(kindOf({}));
  EXPECT_TRUE(kindOf(Bytes(kMaxDatagramBytes, std::byte{1})));
  EXPECT_FALSE(kindOf(Bytes(kMaxDatagramBytes + 1, std::byte{1})));
}

}  // namespace
}  // namespace clothstream::datagram
