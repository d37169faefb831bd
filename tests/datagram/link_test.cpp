// SPDX-License-Identifier: MIT
// Frames over a simulated link: losses agree with the binomial distribution, and requests repair them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "proto/datagram/frame_assembly.h"
#include "proto/datagram/sent_frames.h"
#include "tests/datagram/frames.h"

namespace clothstream::datagram {
namespace {

constexpr std::uint64_t kFrameUs = 13'889;
constexpr std::uint32_t kSimulatedFrames = 1'000;
// Frames repeat after this number, so that parity is made only for these.
constexpr std::uint32_t kDifferent = 32;

struct Conditions {
  std::size_t frameBytes = 2400;
  unsigned parity = 0;
  double loss = 0;
  double burst = 1;  // mean number of packets that are lost in a row
  bool answers = true;
  double jitterUs = 5'000;
  bool ordered = true;
};

struct Outcome {
  std::uint32_t lost = 0;
  double p50 = 0, p99 = 0, max = 0;  // delay beyond that of the link, ms
  AssemblyStatistics statistics;
};

// One direction: 25 ms and an even jitter. Losses are a Markov chain with the stated rate and mean length.
class Link {
 public:
  Link(const Conditions& conditions, unsigned seed) : conditions_(conditions), random_(seed) {}

  static constexpr std::uint64_t kDelayUs = 25'000;

  // Returns the time of arrival, or nothing if the packet is lost.
  std::optional<std::uint64_t> carry(std::uint64_t nowUs) {
    const double stay = 1 - 1 / conditions_.burst;
    const double begin = conditions_.loss * (1 - stay) / (1 - conditions_.loss);
    const bool independent = conditions_.burst == 1;
    losing_ = chance(independent ? conditions_.loss : losing_ ? stay : begin);
    if (losing_) return std::nullopt;
    std::uint64_t us =
        nowUs + kDelayUs + static_cast<std::uint64_t>(chanceIn_(random_) * conditions_.jitterUs);
    if (conditions_.ordered) us = newestUs_ = std::max(newestUs_, us);
    return us;
  }

 private:
  bool chance(double probability) { return chanceIn_(random_) < probability; }

  const Conditions& conditions_;
  std::mt19937 random_;
  std::uniform_real_distribution<double> chanceIn_{0, 1};
  bool losing_ = false;
  std::uint64_t newestUs_ = 0;
};

// A server that sends a frame every 13.9 ms, and a client.
class Simulation {
 public:
  explicit Simulation(const Conditions& conditions)
      : conditions_(conditions), down_(conditions, 1), up_(conditions, 2) {
    assembly_.setRoundTrip(55 * kMs);
    for (std::uint32_t i = 0; i < kDifferent; ++i) {
      messages_.push_back(std::make_shared<const Bytes>(testMessage(conditions.frameBytes, i)));
      frames_.push_back(std::make_shared<const FramePieces>(messages_.back(), conditions.parity + 2));
    }
  }

  Outcome run() {
    for (std::uint32_t i = 0; i < kSimulatedFrames; ++i) at(i * kFrameUs, [this] { sendFrame(); });
    while (!events_.empty()) {
      const auto event = events_.extract(events_.begin());
      nowUs_ = event.key();
      event.mapped()();
    }
    Outcome outcome;
    outcome.lost = kSimulatedFrames - static_cast<std::uint32_t>(delays_.size());
    outcome.statistics = assembly_.statistics();
    std::ranges::sort(delays_);
    const auto quantile = [&](double q) {
      return delays_[static_cast<std::size_t>(q * static_cast<double>(delays_.size() - 1))];
    };
    outcome.p50 = quantile(0.5);
    outcome.p99 = quantile(0.99);
    outcome.max = quantile(1);
    return outcome;
  }

 private:
  void at(std::uint64_t us, std::function<void()> action) { events_.emplace(us, std::move(action)); }

  void sendFrame() {
    const std::uint32_t number = newest_++;
    const auto& frame = frames_[number % kDifferent];
    const unsigned pieces = frame->dataPieces() + conditions_.parity;
    EXPECT_EQ(sent_.add(frame, pieces, nowUs_), number);
    for (unsigned index = 0; index < pieces; ++index) sendPiece(*frame, number, index);
  }

  void sendPiece(const FramePieces& frame, std::uint32_t number, unsigned index) {
    const Bytes datagram = datagramOf(frame, {packet_++, 0, number}, index);
    if (const auto arrival = down_.carry(nowUs_))
      at(*arrival, [this, datagram] {
        assembly_.add(*parsePiece(datagram), nowUs_);
        act();
      });
  }

  void act() {
    while (const auto frame = assembly_.next(nowUs_)) {
      while (!equal(frame->message, *messages_[emitted_ % kDifferent])) {
        ASSERT_TRUE(frame->afterGap) << "a frame is lost without a sign";
        ASSERT_LT(++emitted_, kSimulatedFrames) << "a frame has other bytes than the server sent";
      }
      delays_.push_back(static_cast<double>(nowUs_ - emitted_++ * kFrameUs - Link::kDelayUs) /
                        static_cast<double>(kMs));
    }
    while (const auto request = assembly_.nextRequest(nowUs_)) {
      const auto arrival = up_.carry(nowUs_);
      if (arrival && conditions_.answers) at(*arrival, [this, request] { answer(*request); });
    }
    const auto due = assembly_.dueUs();
    if (due && events_.find(*due) == events_.end()) at(*due, [this] { act(); });
  }

  void answer(const PieceRequest& request) {
    const auto repeat = sent_.answer(request, nowUs_);
    for (unsigned index = 0; repeat && index < repeat->frame->pieces(); ++index)
      if (repeat->pieces[index]) sendPiece(*repeat->frame, repeat->number, index);
  }

  const Conditions& conditions_;
  Link down_, up_;
  std::vector<FramePieces::Message> messages_;
  std::vector<std::shared_ptr<const FramePieces>> frames_;
  SentFrames sent_;
  FrameAssembly assembly_;
  std::multimap<std::uint64_t, std::function<void()>> events_;
  std::uint64_t nowUs_ = 0;
  std::uint32_t newest_ = 0, packet_ = 0, emitted_ = 0;
  std::vector<double> delays_;  // ms
};

Outcome simulate(const Conditions& conditions) {
  const Outcome outcome = Simulation(conditions).run();
  std::printf(
      "%5zu B, parity %u, %s, loss %4.1f %% in bursts of %.0f: %u of %u frames lost, delay p50 %.1f p99 %.1f "
      "max %.1f ms, %llu requests\n",
      conditions.frameBytes, conditions.parity, conditions.answers ? "requests" : "no answers",
      100 * conditions.loss, conditions.burst, outcome.lost, kSimulatedFrames, outcome.p50, outcome.p99,
      outcome.max, static_cast<unsigned long long>(outcome.statistics.requests));
  return outcome;
}

// Probability that more than `allowed` of `count` packets are lost independently.
double tooManyLost(unsigned count, unsigned allowed, double loss) {
  double sum = 0, binomial = 1;
  for (unsigned lost = 0; lost <= count; ++lost) {
    if (lost > allowed) sum += binomial * std::pow(loss, lost) * std::pow(1 - loss, count - lost);
    binomial *= static_cast<double>(count - lost) / (lost + 1);
  }
  return sum;
}

// Five standard deviations of a binomial count, and one.
double tolerance(double probability) {
  return 5 * std::sqrt(kSimulatedFrames * probability * (1 - probability)) + 1;
}

TEST(DatagramLink, ParityLosesAsTheBinomialSays) {
  for (const std::size_t bytes : {2400u, 7300u})
    for (const unsigned parity : {0u, 1u, 2u})
      for (const double loss : {0.0, 0.01, 0.05, 0.1}) {
        const Outcome outcome =
            simulate({.frameBytes = bytes, .parity = parity, .loss = loss, .answers = false});
        const unsigned count = testFrame(bytes, 0)->dataPieces();
        const double lost = tooManyLost(count + parity, parity, loss);
        EXPECT_NEAR(outcome.lost, kSimulatedFrames * lost, tolerance(lost))
            << bytes << " bytes, " << parity << ", " << loss;
      }
}

TEST(DatagramLink, RequestsRepairAlmostEverything) {
  for (const std::size_t bytes : {2400u, 7300u})
    for (const unsigned parity : {0u, 2u})
      for (const double loss : {0.0, 0.01, 0.02, 0.05, 0.1}) {
        const Outcome outcome = simulate({.frameBytes = bytes, .parity = parity, .loss = loss});
        // The answer to a second request comes about at the deadline, so only one is sure to help. It fails
        // if it is lost, or if two of about three repeated pieces are.
        const unsigned count = testFrame(bytes, 0)->dataPieces();
        const double incomplete = tooManyLost(count + parity, parity, loss);
        const double lost = incomplete * (loss + 3 * loss * loss);
        EXPECT_LE(outcome.lost, kSimulatedFrames * lost + tolerance(lost))
            << bytes << " bytes, " << parity << ", " << loss;
        // A repair takes the time to the next frame, a round trip, and jitter. A frame that needs a second
        // one delays about seven others.
        if (8 * lost < 0.005) {
          EXPECT_LE(outcome.p99, 14 + 55 + 10) << bytes << " bytes, " << parity << ", " << loss;
        }
        if (loss == 0) {
          EXPECT_EQ(outcome.statistics.requests, 1u) << "only the last frame's successor is requested";
        }
      }
}

TEST(DatagramLink, BurstsAreRepaired) {
  for (const double loss : {0.02, 0.05}) {
    const Outcome outcome = simulate({.frameBytes = 7300, .parity = 2, .loss = loss, .burst = 4});
    EXPECT_LE(outcome.lost, kSimulatedFrames / 100) << loss;
    EXPECT_LE(outcome.max, 150 + 14 + 5) << "the deadline, the time to the next frame, and jitter";
  }
}

TEST(DatagramLink, ReorderingCausesFewRequests) {
  const Outcome outcome = simulate({.parity = 1, .loss = 0, .jitterUs = 20'000, .ordered = false});
  EXPECT_EQ(outcome.lost, 0u);
  EXPECT_LE(outcome.statistics.requests, kSimulatedFrames / 20);
  const Outcome lossy = simulate({.parity = 1, .loss = 0.05, .jitterUs = 20'000, .ordered = false});
  EXPECT_LE(lossy.lost, 2u);
}

}  // namespace
}  // namespace clothstream::datagram
