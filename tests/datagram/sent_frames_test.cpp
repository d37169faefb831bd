// SPDX-License-Identifier: MIT
// Requests for pieces, their answers, and their price.
#include "proto/datagram/sent_frames.h"

#include <array>

#include <gtest/gtest.h>

#include "tests/datagram/frames.h"

namespace clothstream::datagram {
namespace {

PieceSet setOf(std::initializer_list<std::size_t> indices) {
  PieceSet set;
  for (const std::size_t index : indices) set[index] = true;
  return set;
}

Bytes written(const PieceRequest& request) {
  std::array<std::byte, kMaxDatagramBytes> out;
  const std::size_t bytes = writeRequest(request, out);
  return {out.begin(), out.begin() + static_cast<std::ptrdiff_t>(bytes)};
}

TEST(PieceRequest, ReadsWhatItWrites) {
  for (const PieceSet& present : {PieceSet(), setOf({0}), setOf({7, 8}), setOf({159}), ~PieceSet()}) {
    const auto request = parseRequest(written({.frame = 0xfffffffe, .present = present}));
    ASSERT_TRUE(request);
    EXPECT_EQ(request->frame, 0xfffffffe);
    EXPECT_EQ(request->present, present);
  }
  const Bytes bytes = written({.frame = 0x01020304, .present = setOf({0, 9})});
  EXPECT_EQ(bytes, (Bytes{std::byte{3}, std::byte{4}, std::byte{3}, std::byte{2}, std::byte{1}, std::byte{1},
                          std::byte{2}}));
}

TEST(PieceRequest, RefusesOtherLengths) {
  Bytes bytes = written({.frame = 1, .present = ~PieceSet()});
  ASSERT_EQ(bytes.size(), 25u);
  EXPECT_FALSE(parseRequest(std::span(bytes).first(4)));
  bytes.push_back(std::byte{1});
  EXPECT_FALSE(parseRequest(bytes)) << "161 pieces";
  bytes.resize(6);
  bytes[5] = {};
  EXPECT_FALSE(parseRequest(bytes)) << "a mask that ends with zeros";
  bytes[0] = std::byte{4};
  EXPECT_FALSE(parseRequest(bytes));
}

TEST(SentFrames, SendsWhatIsMissingAndOneMore) {
  SentFrames sent;
  EXPECT_EQ(sent.add(testFrame(2400, 2), 4, 0), 0u);
  EXPECT_EQ(sent.add(testFrame(7300, 2), 8, 0), 1u);
  const auto pieces = [&](std::uint32_t frame, const PieceSet& present) {
    const auto repeat = sent.answer({.frame = frame, .present = present}, 1);
    return repeat ? repeat->pieces : PieceSet();
  };
  EXPECT_EQ(pieces(0, {}), setOf({0, 1, 2, 3}));
  EXPECT_EQ(pieces(0, setOf({0, 2})), setOf({1, 3}));
  EXPECT_EQ(pieces(0, setOf({0, 3})), setOf({1, 2}));
  EXPECT_EQ(pieces(0, setOf({1, 4})), setOf({0, 2}));
  EXPECT_EQ(pieces(0, setOf({0, 1, 4})), PieceSet()) << "three pieces are enough";
  EXPECT_EQ(pieces(1, setOf({0, 1, 2, 3, 4, 5})), setOf({6, 7}));
  EXPECT_EQ(pieces(0, setOf({0, 159})), setOf({1, 2, 3})) << "piece 159 does not exist";
}

TEST(SentFrames, RepeatKeepsTheFramesNumber) {
  SentFrames sent;
  sent.add(testFrame(100, 0), 1, 0);
  const auto frame = testFrame(200, 0);
  const std::uint32_t number = sent.add(frame, 1, 0);
  const auto repeat = sent.answer({.frame = number, .present = {}}, 1);
  ASSERT_TRUE(repeat);
  EXPECT_EQ(repeat->number, number);
  EXPECT_EQ(repeat->frame, frame);
}

TEST(SentFrames, UnknownFramesAreNotAnswered) {
  SentFrames sent;
  EXPECT_FALSE(sent.answer({}, 0)) << "nothing was sent";
  sent.add(testFrame(100, 0), 1, 0);
  EXPECT_FALSE(sent.answer({.frame = 1, .present = {}}, 0));
  EXPECT_FALSE(sent.answer({.frame = 0xffffffff, .present = {}}, 0));
  EXPECT_TRUE(sent.answer({.frame = 0, .present = {}}, SentFrames::kKeptUs));
  EXPECT_FALSE(sent.answer({.frame = 0, .present = {}}, SentFrames::kKeptUs + 1)) << "too old";
}

TEST(SentFrames, ForgetsBeyondItsBounds) {
  SentFrames sent;
  for (std::uint32_t i = 0; i <= SentFrames::kMaxFrames; ++i) sent.add(testFrame(10, 0), 1, 0);
  EXPECT_FALSE(sent.answer({.frame = 0, .present = {}}, 0));
  EXPECT_TRUE(sent.answer({.frame = 1, .present = {}}, 0));

  const auto large = testFrame(100'000, 0);
  for (int i = 0; i < 5; ++i) sent.add(large, 0, 0);
  EXPECT_TRUE(sent.answer({.frame = 65, .present = ~PieceSet() << 1}, 0)) << "500,000 bytes are kept";
  sent.add(large, 0, 0);
  EXPECT_FALSE(sent.answer({.frame = 65, .present = ~PieceSet() << 1}, 0));
  EXPECT_TRUE(sent.answer({.frame = 66, .present = ~PieceSet() << 1}, 0));

  sent.add(testFrame(10, 0), 1, SentFrames::kKeptUs + 1);
  EXPECT_FALSE(sent.answer({.frame = 70, .present = {}}, SentFrames::kKeptUs + 1));
}

TEST(SentFrames, RepeatsStayWithinTheBudget) {
  SentFrames sent;
  std::size_t first = 0, again = 0;
  for (std::uint64_t nowUs = 0; nowUs < 2'000'000; nowUs += 14'000) {
    const auto frame = testFrame(7300, 2);
    const std::uint32_t number = sent.add(frame, 8, nowUs);
    first += 8 * frame->datagramBytes();
    for (int i = 0; i < 50; ++i)
      if (const auto repeat = sent.answer({.frame = number, .present = {}}, nowUs))
        again += repeat->pieces.count() * frame->datagramBytes();
  }
  EXPECT_LE(again, first / 2 + SentFrames::kMaxBudget);
  EXPECT_GT(again, first / 2) << "honest peers need repeats";
}

}  // namespace
}  // namespace clothstream::datagram
