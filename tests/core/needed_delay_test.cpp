// SPDX-License-Identifier: MIT
// Delay of play-out for sequences of arrivals: steady, jittered, stalled, in bursts, with a drifting clock.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <iterator>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "clients/core/stream/play_out_delay.h"

namespace clothstream::client {
namespace {

constexpr double kFrameMs = 1000.0 / 72, kWayMs = 30, kCalmMs = kFrameMs + kWayMs;
constexpr double kMostMs = 250;
// Times are whole microseconds.
constexpr double kRoundingMs = 0.002;

// Frames of 72 Hz over an ordered link, shown when they arrive.
struct Arrivals {
  // Time under way beyond kWayMs of a frame that is sent at a time in ms.
  std::function<double(double)> extraMs = [](double) { return 0.0; };
  std::function<bool(double)> sends = [](double) { return true; };
  double drift = 0;  // growth of the estimated server's time, relative to the true one

  struct Frame {
    double ms = 0;  // time of arrival
    double delayMs = 0;
    bool late = false;  // the delay before this frame was shorter than it needed
  };

  std::vector<Frame> run(double seconds) const {
    PlayOutDelay delay;
    std::vector<Frame> shown;
    double arrival = 0;
    std::optional<double> before;  // when the previous frame was sent
    for (double sent = 0; sent < 1000 * seconds; sent += kFrameMs) {
      if (!sends(sent)) continue;
      arrival = std::max(arrival, sent + kWayMs + extraMs(sent));
      const double at = kStartMs + arrival * (1 + drift);
      const std::optional<double> previous = std::exchange(before, sent);
      if (!previous) continue;
      const double needed = at - kStartMs - *previous;
      const bool late = delay.known() && 1000 * needed > delay.us() + 1000 * kRoundingMs;
      delay.sample(std::round(1000 * needed), static_cast<std::uint64_t>(std::llround(1000 * at)));
      const auto elapsedUs = shown.empty() ? std::nullopt : std::optional(1000 * (arrival - shown.back().ms));
      delay.move(0, elapsedUs, 0, 1000 * kMostMs);
      shown.push_back({arrival, delay.us() / 1000, late});
    }
    return shown;
  }

  static constexpr double kStartMs = 5e6;
};

using Frames = std::vector<Arrivals::Frame>;

Frames between(const Frames& all, double fromMs, double toMs) {
  Frames some;
  std::copy_if(all.begin(), all.end(), std::back_inserter(some),
               [&](const auto& one) { return one.ms >= fromMs && one.ms < toMs; });
  return some;
}

double longest(const Frames& shown) {
  return std::max_element(shown.begin(), shown.end(),
                          [](const auto& a, const auto& b) { return a.delayMs < b.delayMs; })
      ->delayMs;
}

double shortest(const Frames& shown) {
  return std::min_element(shown.begin(), shown.end(),
                          [](const auto& a, const auto& b) { return a.delayMs < b.delayMs; })
      ->delayMs;
}

double lateShare(const Frames& shown) {
  const auto late = std::count_if(shown.begin(), shown.end(), [](const auto& one) { return one.late; });
  return static_cast<double>(late) / static_cast<double>(shown.size());
}

// No frame arrives for `ms` from this time on; those that are then under way arrive together.
std::function<double(double)> stall(double atMs, double ms) {
  return [=](double sent) {
    const double due = sent + kWayMs;
    return due >= atMs && due < atMs + ms ? atMs + ms - due : 0.0;
  };
}

std::function<double(double)> jitter(double ms, unsigned seed = 1) {
  return [=, random = std::mt19937(seed)](double) mutable {
    return std::uniform_real_distribution<>(0, ms)(random);
  };
}

TEST(NeededDelay, IsExactOnASteadyLink) {
  const Frames shown = Arrivals{}.run(20);
  EXPECT_NEAR(shortest(shown), kCalmMs, kRoundingMs);
  EXPECT_NEAR(longest(shown), kCalmMs, kRoundingMs);
}

TEST(NeededDelay, CoversJitterAt98Percent) {
  for (const unsigned seed : {1u, 2u, 3u}) {
    const Frames shown = between(Arrivals{.extraMs = jitter(5, seed)}.run(60), 15'000, 60'000);
    // The slowest of the 72 frames of a second needs less than 0.9 of the range once in 2,000 seconds.
    EXPECT_GE(shortest(shown), kCalmMs + 0.9 * 5);
    EXPECT_LE(longest(shown), kCalmMs + 5);
    // Seconds whose slowest frame needs less than p98 add late frames: the first to need more in the next
    // one.
    EXPECT_LE(lateShare(shown), 0.03) << seed;
  }
}

TEST(NeededDelay, ReturnsInTwoSecondsAfterAStall) {
  for (const double at : {500.0, 3000.0, 20'000.0}) {
    for (const double ms : {100.0, 300.0, 1000.0}) {
      const Frames shown = Arrivals{.extraMs = stall(at, ms)}.run(30);
      // The delay grows at most for the second in which late frames are remembered, and falls as fast.
      EXPECT_LE(longest(shown), kCalmMs + PlayOutDelay::kSlew * (1000 + 2 * kFrameMs)) << at << ' ' << ms;
      EXPECT_NEAR(longest(between(shown, at + ms + 2000 + 4 * kFrameMs, 30'000)), kCalmMs, kRoundingMs)
          << at << ' ' << ms;
    }
  }
}

TEST(NeededDelay, IgnoresARareStall) {
  Arrivals link;
  // 13 or 14 late frames every ten seconds, which are less than 2 %. BBR does this where it probes the round
  // trip.
  link.extraMs = [](double sent) { return stall(1e4 * std::ceil(sent / 1e4) - 180, 180)(sent); };
  EXPECT_NEAR(longest(between(link.run(100), 13'000, 100'000)), kCalmMs, kRoundingMs);
}

TEST(NeededDelay, CoversRecurringStalls) {
  Arrivals link;
  // A lost packet every 0.7 s holds frames back for 80 ms: 11 % of them.
  link.extraMs = [](double sent) { return stall(700 * std::ceil(sent / 700) - 80, 80)(sent); };
  const Frames shown = between(link.run(40), 5000, 40'000);
  EXPECT_LE(lateShare(shown), 0.02);
  EXPECT_GE(shortest(shown), kCalmMs + 80 - 2 * kFrameMs) << "the second late frame of each stall";
  EXPECT_LE(longest(shown), kCalmMs + 80);
}

TEST(NeededDelay, FollowsADisturbanceUpAndDown) {
  Arrivals link;
  link.extraMs = [noise = jitter(90)](double sent) mutable {
    return sent >= 10'000 && sent < 20'000 ? noise(sent) : 0.0;
  };
  const Frames shown = link.run(30);
  // 2 % of 1,024 frames are 21, of which some in each 1,024 / 21 frames; then 90 ms at the slew.
  EXPECT_GE(shortest(between(shown, 13'000, 20'000)), kCalmMs + 0.8 * 90);
  EXPECT_LE(longest(shown), kCalmMs + 90);
  EXPECT_NEAR(longest(between(shown, 20'100 + 2000, 30'000)), kCalmMs, kRoundingMs);
}

TEST(NeededDelay, ForgetsASlowStart) {
  Arrivals link;
  // A window that has not grown yet.
  link.sends = [](double sent) { return sent < kFrameMs || sent > 8 * kFrameMs; };
  EXPECT_NEAR(longest(between(link.run(5), 170, 5000)), kCalmMs, kRoundingMs);
  link.sends = [](double) { return true; };
  // The frames of the first 100 ms arrive together.
  link.extraMs = [](double sent) { return std::max(0.0, 100 - sent); };
  EXPECT_NEAR(longest(between(link.run(5), 300, 5000)), kCalmMs, kRoundingMs);
}

TEST(NeededDelay, FollowsADriftingClock) {
  for (const double drift : {-1e-4, 1e-4}) {
    const Frames shown = Arrivals{.drift = drift}.run(120);
    for (const Arrivals::Frame& one : shown) {
      // Rising needs are followed after 2 % of the remembered frames, falling ones after a second.
      ASSERT_NEAR(one.delayMs, kCalmMs + drift * one.ms, 1e-4 * 1000 + 2 * kRoundingMs) << one.ms;
    }
  }
}

TEST(NeededDelay, SurvivesAClockThatJumpsBack) {
  PlayOutDelay delay;
  for (std::uint64_t at = 5'000'000'000; at < 5'002'000'000; at += 10'000) delay.sample(200'000, at);
  delay.move(0, std::nullopt, 0, 1e9);
  EXPECT_EQ(delay.us(), 200'000);
  for (std::uint64_t at = 1'000'000; at < 1'200'000; at += 10'000) delay.sample(40'000, at);
  delay.move(0, std::nullopt, 0, 1e9);
  EXPECT_EQ(delay.us(), 40'000);
}

}  // namespace
}  // namespace clothstream::client
