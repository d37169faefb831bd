// SPDX-License-Identifier: MIT
// Order, requests, deadlines and bounds of the client's side.
#include "proto/datagram/frame_assembly.h"

#include <algorithm>
#include <initializer_list>
#include <map>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/datagram/frames.h"

namespace clothstream::datagram {
namespace {

constexpr unsigned kParity = 3;

// Sends pieces of frames, which have three data pieces, and keeps the frames that are emitted.
class AssemblyTest : public ::testing::Test {
 protected:
  void send(std::uint32_t frame, std::initializer_list<unsigned> pieces, std::uint64_t nowUs) {
    for (const unsigned index : pieces) sendPacket(packet_++, frame, index, nowUs);
  }

  void sendPacket(std::uint32_t packet, std::uint32_t frame, unsigned index, std::uint64_t nowUs) {
    const auto [entry, added] = frames_.try_emplace(frame);
    if (added) {
      entry->second = testFrame(bytes_, kParity, frame);
      messages_.emplace(frame, testMessage(bytes_, frame));
    }
    const Bytes datagram = datagramOf(*entry->second, {packet, 0, frame}, index);
    assembly_.add(*parsePiece(datagram), nowUs);
    collect(nowUs);
  }

  // Numbers of the frames that come out now.
  std::vector<std::uint32_t> collect(std::uint64_t nowUs) {
    std::vector<std::uint32_t> numbers;
    while (const auto frame = assembly_.next(nowUs)) {
      const auto sent = std::ranges::find_if(
          messages_, [&](const auto& entry) { return equal(frame->message, entry.second); });
      if (sent == messages_.end()) {
        ADD_FAILURE() << "no such message was sent, or it was emitted before";
        continue;
      }
      numbers.push_back(sent->first);
      messages_.erase(sent);
      if (frame->afterGap) gaps_.push_back(numbers.back());
    }
    emitted_.insert(emitted_.end(), numbers.begin(), numbers.end());
    return numbers;
  }

  // Frames of the requests that are to be sent now.
  std::vector<std::uint32_t> requests(std::uint64_t nowUs) {
    std::vector<std::uint32_t> numbers;
    while (const auto request = assembly_.nextRequest(nowUs)) {
      numbers.push_back(request->frame);
      present_ = request->present;
    }
    return numbers;
  }

  using Numbers = std::vector<std::uint32_t>;

  std::size_t bytes_ = 2400;
  FrameAssembly assembly_;
  std::uint32_t packet_ = 0;
  std::map<std::uint32_t, std::shared_ptr<const FramePieces>> frames_;
  std::map<std::uint32_t, Bytes> messages_;  // of these, those that were not emitted
  Numbers emitted_, gaps_;
  PieceSet present_;  // of the last request
};

TEST_F(AssemblyTest, EmitsCompleteFrames) {
  send(0, {0, 1}, 0);
  EXPECT_TRUE(emitted_.empty());
  send(0, {2}, 0);
  send(1, {2, 0, 1}, 0);
  EXPECT_EQ(emitted_, (Numbers{0, 1}));
  EXPECT_TRUE(gaps_.empty());
  EXPECT_EQ(assembly_.statistics().repairedFrames, 0u);
}

TEST_F(AssemblyTest, RepairsEveryPatternOfLosses) {
  for (bytes_ = 900; bytes_ <= 4 * kMaxPayloadBytes; bytes_ += kMaxPayloadBytes) {
    const unsigned count = testFrame(bytes_, 0)->dataPieces();
    for (unsigned mask = 0; mask < 1u << (count + kParity); ++mask) {
      assembly_ = FrameAssembly();
      emitted_.clear();
      frames_.clear();
      messages_.clear();
      unsigned arrived = 0;
      for (unsigned index = 0; index < count + kParity; ++index)
        if ((mask >> index & 1) != 0) send(0, {index}, 0), ++arrived;
      EXPECT_EQ(emitted_.size(), arrived >= count ? 1u : 0u) << count << " data pieces, " << mask;
      EXPECT_EQ(assembly_.statistics().uselessPieces, arrived > count ? arrived - count : 0);
    }
  }
}

TEST_F(AssemblyTest, DuplicatesAreUseless) {
  send(0, {0, 0, 0, 4, 4}, 0);
  EXPECT_TRUE(emitted_.empty());
  EXPECT_EQ(assembly_.statistics().uselessPieces, 3u);
  send(0, {1, 1}, 0);
  EXPECT_EQ(emitted_, Numbers{0});
  EXPECT_EQ(assembly_.statistics().uselessPieces, 4u);
  EXPECT_EQ(assembly_.statistics().repairedFrames, 1u);
}

TEST_F(AssemblyTest, LaterFramesWaitForEarlierOnes) {
  send(0, {0, 1}, 0);
  send(2, {0, 1, 2}, 1 * kMs);
  send(1, {0, 1, 2}, 2 * kMs);
  EXPECT_TRUE(emitted_.empty());
  send(0, {2}, 3 * kMs);
  EXPECT_EQ(emitted_, (Numbers{0, 1, 2}));
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(AssemblyTest, GivesUpAtTheDeadline) {
  send(0, {0, 1, 2}, 0);
  send(1, {0}, 10 * kMs);
  send(2, {0, 1, 2}, 20 * kMs);
  send(3, {0, 1, 2}, 30 * kMs);
  EXPECT_TRUE(collect(160 * kMs - 1).empty());
  EXPECT_EQ(collect(160 * kMs), (Numbers{2, 3}));
  EXPECT_EQ(gaps_, Numbers{2}) << "the sign of a gap is given once";
  EXPECT_EQ(assembly_.statistics().lostFrames, 1u);
  send(1, {1}, 161 * kMs);
  EXPECT_EQ(assembly_.statistics().uselessPieces, 1u);
}

TEST_F(AssemblyTest, RequestsWhatALaterFrameOvertook) {
  send(0, {0, 2}, 0);
  EXPECT_TRUE(requests(13 * kMs).empty());
  send(1, {0}, 14 * kMs);
  EXPECT_EQ(requests(14 * kMs), Numbers{0});
  EXPECT_EQ(present_, PieceSet(0b101));
  send(0, {1}, 70 * kMs);
  EXPECT_EQ(emitted_, Numbers{0});
  EXPECT_EQ(assembly_.statistics().repairedFrames, 1u);
}

TEST_F(AssemblyTest, RequestsWholeFrames) {
  send(0, {0, 1, 2}, 0);
  send(3, {0, 1, 2}, 40 * kMs);
  EXPECT_EQ(requests(40 * kMs), (Numbers{1, 2}));
  EXPECT_EQ(present_, PieceSet());
  send(2, {0, 1, 2}, 90 * kMs);
  send(1, {0, 1, 2}, 90 * kMs);
  EXPECT_EQ(emitted_, (Numbers{0, 1, 2, 3}));
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(AssemblyTest, FirstFramesMayBeMissing) {
  send(2, {0, 1, 2}, 0);
  EXPECT_EQ(requests(0), (Numbers{0, 1}));
  EXPECT_EQ(collect(FrameAssembly::kDeadlineUs), Numbers{2});
  EXPECT_EQ(gaps_, Numbers{2});
}

TEST_F(AssemblyTest, AsksAgainAfterOneAndAHalfRoundTrips) {
  assembly_.setRoundTrip(40 * kMs);
  send(0, {0}, 0);
  send(1, {0, 1, 2}, 10 * kMs);
  std::vector<std::uint64_t> times;
  for (std::uint64_t us = 10 * kMs; us < 200 * kMs; us += kMs) {
    collect(us);
    for (const std::uint32_t frame : requests(us))
      if (frame == 0) times.push_back(us / kMs);
  }
  EXPECT_EQ(times, (std::vector<std::uint64_t>{10, 70, 130}));
}

TEST_F(AssemblyTest, ShortRoundTripsCauseFewRequests) {
  assembly_.setRoundTrip(100);
  send(0, {0}, 0);
  send(1, {0}, 1 * kMs);
  std::size_t count = 0;
  for (std::uint64_t us = kMs; us < 150 * kMs; us += 100) count += requests(us).size();
  EXPECT_LE(count, 31u);
}

TEST_F(AssemblyTest, RequestsTheLostEndOfTheLastFrame) {
  std::uint64_t us = 0;
  for (std::uint32_t frame = 0; frame < 40; ++frame, us += 14 * kMs) send(frame, {0, 1, 2}, us);
  send(40, {0, 1}, us);
  EXPECT_TRUE(requests(us + 27 * kMs).empty());
  EXPECT_EQ(*assembly_.dueUs() / kMs, us / kMs + 28);
  EXPECT_EQ(requests(*assembly_.dueUs()).front(), 40u);
}

TEST_F(AssemblyTest, ProbesForTheLastFrameOnce) {
  send(0, {0, 1, 2}, 0);
  EXPECT_TRUE(requests(49 * kMs).empty());
  EXPECT_EQ(assembly_.dueUs(), 50 * kMs);
  EXPECT_EQ(requests(50 * kMs), Numbers{1});
  EXPECT_TRUE(requests(500 * kMs).empty());
  EXPECT_FALSE(assembly_.dueUs()) << "the stream is idle";
  send(1, {0, 1, 2}, 600 * kMs);
  EXPECT_EQ(emitted_, (Numbers{0, 1}));
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(AssemblyTest, WaitsWherePacketsOvertakeEachOther) {
  // Piece 2 of each frame arrives 5 ms after the first one of the next frame.
  std::uint64_t us = 0;
  std::uint32_t frame = 0;
  std::size_t late = 0;
  for (; frame < 60; ++frame, us += 14 * kMs) {
    sendPacket(3 * frame, frame, 0, us);
    if (frame >= 30) late += requests(us).size();
    sendPacket(3 * frame + 1, frame, 1, us);
    if (frame > 0) sendPacket(3 * (frame - 1) + 2, frame - 1, 2, us + 5 * kMs);
  }
  EXPECT_EQ(late, 0u) << "the order of the link was learned";
  EXPECT_EQ(emitted_.size(), 59u);
}

TEST_F(AssemblyTest, LargeJumpsAreGapsAtOnce) {
  send(0, {0, 1, 2}, 0);
  send(FrameAssembly::kMaxMissing + 2, {0, 1, 2}, 10 * kMs);
  EXPECT_EQ(emitted_, (Numbers{0, 10}));
  EXPECT_EQ(gaps_, Numbers{10});
  EXPECT_EQ(assembly_.statistics().lostFrames, 9u);
  EXPECT_TRUE(requests(10 * kMs).empty());
  send(FrameAssembly::kMaxMissing + 1, {0, 1, 2}, 11 * kMs);
  EXPECT_EQ(emitted_.size(), 2u) << "frames of the gap are late";
}

TEST_F(AssemblyTest, HoldsABoundedNumberOfFrames) {
  send(0, {0}, 0);
  for (std::uint32_t frame = 1; frame < FrameAssembly::kMaxFrames; ++frame) send(frame, {0, 1, 2}, 0);
  EXPECT_TRUE(emitted_.empty());
  send(FrameAssembly::kMaxFrames, {0, 1, 2}, 0);
  EXPECT_EQ(emitted_, Numbers{FrameAssembly::kMaxFrames});
  EXPECT_EQ(assembly_.statistics().lostFrames, FrameAssembly::kMaxFrames);
}

TEST_F(AssemblyTest, NumbersContinueWithZero) {
  send(0x7fffffff, {0, 1, 2}, 0);
  send(0xfffffffd, {0, 1, 2}, 0);
  emitted_.clear();
  gaps_.clear();
  send(0xfffffffe, {0, 1}, 0);
  send(0, {0, 1, 2}, 14 * kMs);
  EXPECT_EQ(requests(14 * kMs), (Numbers{0xfffffffe, 0xffffffff}));
  send(0xffffffff, {0, 1, 2}, 60 * kMs);
  send(0xfffffffe, {4}, 60 * kMs);
  send(1, {0, 1, 2}, 60 * kMs);
  EXPECT_EQ(emitted_, (Numbers{0xfffffffe, 0xffffffff, 0, 1}));
  EXPECT_TRUE(gaps_.empty());
}

TEST_F(AssemblyTest, RefusesContradictingPieces) {
  const auto frame = testFrame(2400, 0, 0), other = testFrame(2401, 0, 1), more = testFrame(7300, 0, 2);
  for (const auto& pieces : {frame, other, more}) {
    const Bytes datagram = datagramOf(*pieces, {}, pieces == frame ? 0 : 1);
    assembly_.add(*parsePiece(datagram), 0);
  }
  EXPECT_EQ(assembly_.statistics().uselessPieces, 2u);
}

TEST_F(AssemblyTest, ShuffledAndRepeatedPiecesGiveEveryFrame) {
  std::mt19937 random(11);
  constexpr std::uint32_t kFrames = 100;
  struct Sent {
    double order;
    std::uint32_t frame;
    unsigned index;
  };
  std::vector<Sent> all;
  for (std::uint32_t frame = 0; frame < kFrames; ++frame)
    for (unsigned index = 0; index < 3; ++index)
      for (unsigned copy = 0; copy < 1 + random() % 2; ++copy)
        all.push_back({frame + std::uniform_real_distribution(0.0, 6.0)(random), frame, index});
  std::ranges::sort(all, {}, &Sent::order);
  for (const Sent& piece : all) send(piece.frame, {piece.index}, 0);
  ASSERT_EQ(emitted_.size(), kFrames);
  EXPECT_TRUE(std::ranges::is_sorted(emitted_));
  EXPECT_TRUE(gaps_.empty());
}

}  // namespace
}  // namespace clothstream::datagram
