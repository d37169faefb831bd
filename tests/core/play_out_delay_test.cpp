// SPDX-License-Identifier: MIT
// Adaptive delay of play-out, and the motion that is shown with it.
#include "clients/core/stream/play_out_delay.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <deque>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "clients/core/core.h"
#include "tests/core/play_out_viewer.h"

namespace clothstream::client {
namespace {

// Frames over an ordered link, shown 90 times a second.
struct JitteredRun {
  double networkMs = 30;
  std::function<double(std::mt19937&, double)> jitterMs;  // jitter at a time in ms
  std::function<bool(double)> sends = [](double) { return true; };
  double aheadMs = 0;  // display time minus now

  struct Shown {
    double ms = 0;  // display time
    cs_played played{};
    double delayMs = 0;
    double error = 0;  // m; largest distance of a vertex from its true position at the shown time
  };

  // The first tick starts at 1 s.
  std::vector<Shown> run(double seconds, unsigned seed = 1) const {
    Viewer viewer;
    viewer.learnClock();
    std::mt19937 random(seed);
    struct Message {
      double ms;
      std::string bytes;
    };
    std::deque<Message> underway;
    std::vector<Shown> shown;
    double arrival = 0, nextTick = 1000;
    std::uint64_t tick = 0;
    for (double ms = 1000; ms < 1000 + 1000 * seconds; ms += 1000.0 / 90) {
      for (; nextTick <= ms; nextTick += 10) {
        ++tick;
        const auto tickUs = static_cast<std::uint64_t>(1000 * nextTick);
        if (!sends(nextTick)) continue;
        arrival = std::max(arrival, nextTick + networkMs + jitterMs(random, nextTick));
        underway.push_back({arrival, viewer.frame(tick, tickUs)});
      }
      for (; !underway.empty() && underway.front().ms <= ms; underway.pop_front())
        viewer.client.receive(underway.front().bytes, static_cast<std::uint64_t>(1000 * underway.front().ms));
      const auto nowUs = static_cast<std::uint64_t>(1000 * ms);
      const auto displayUs = static_cast<std::uint64_t>(1000 * (ms + aheadMs));
      Shown one{.ms = ms, .played = viewer.play(nowUs, displayUs)};
      one.delayMs = viewer.stages().delay_ms;
      const double at =
          (static_cast<double>(one.played.server_time_us - kServerAhead) / 1000 - 1000) / 10 + 1;
      one.error = errorAt(viewer.playedPositions(), at);
      shown.push_back(one);
    }
    return shown;
  }

  // Largest distance from ScriptedServer's wave at a tick, which may be fractional.
  static double errorAt(const Floats& positions, double tick) {
    double largest = 0;
    for (std::uint32_t row = 0; row < 9; ++row) {
      for (std::uint32_t column = 0; column < 7; ++column) {
        const double x = 0.1 * column, y = -0.1 * row, z = 0.05 * std::sin(tick * 0.1 + 3 * x + 2 * y);
        const float* p = &positions[3 * (row * 7 + column)];
        largest = std::max(largest, std::hypot(p[0] - x, p[1] - y, p[2] - z));
      }
    }
    return largest;
  }
};

bool isInTime(const JitteredRun::Shown& one) {
  return one.played.shown == CS_SHOWN_FRAME || one.played.shown == CS_SHOWN_BETWEEN;
}

// Codec error plus the error of linear interpolation on the wave: h^2 / 8 times its curvature.
const double kMaxError = std::sqrt(3.0) * 0.0005 + 0.05 * 0.1 * 0.1 / 8 + 1e-6;

TEST(PlayOut, ShowsTrueMotionDespiteJitter) {
  const auto uniform = [](std::mt19937& random, double) {
    return std::uniform_real_distribution<>(0, 25)(random);
  };
  const auto queues = [](std::mt19937& random, double) {
    return std::exponential_distribution<>(1 / 5.0)(random);
  };
  for (const bool isUniform : {true, false}) {
    for (const unsigned seed : {1u, 2u, 3u}) {
      JitteredRun link;
      link.jitterMs = isUniform ? decltype(link.jitterMs)(uniform) : queues;
      const std::vector<JitteredRun::Shown> shown = link.run(20, seed);
      std::size_t inTime = 0, counted = 0;
      double error = 0;
      for (std::size_t i = 1; i < shown.size(); ++i) {
        if (shown[i].ms < 4000) continue;
        ++counted;
        if (isInTime(shown[i])) {
          ++inTime;
          error = std::max(error, shown[i].error);
          ASSERT_LE(shown[i].error, kMaxError) << shown[i].ms;
        }
        const auto passed =
            static_cast<double>(shown[i].played.server_time_us - shown[i - 1].played.server_time_us);
        const double displayed = 1000 * (shown[i].ms - shown[i - 1].ms);
        ASSERT_NEAR(passed / displayed, 1, PlayOutDelay::kSlew + 2 / displayed)
            << "rounding loses a microsecond at either end";
      }
      // The wanted delay is enough for 98 % of the past frames. The current delay follows it.
      EXPECT_GE(static_cast<double>(inTime), 0.96 * static_cast<double>(counted)) << isUniform << seed;
      std::printf("%s: %.1f %% in time, within %.2f mm of the truth; delay %.1f ms\n",
                  isUniform ? "0 to 25 ms" : "queues of 5 ms",
                  100 * static_cast<double>(inTime) / static_cast<double>(counted), 1000 * error,
                  shown.back().delayMs);
      if (isUniform) {
        // One frame interval, the network delay, and 98 % of the jitter, which the ordered link lengthens.
        EXPECT_GE(shown.back().delayMs, 10 + 30 + 0.9 * 25);
        EXPECT_LE(shown.back().delayMs, 10 + 30 + 25);
      }
    }
  }
}

TEST(PlayOut, DelayFollowsJitterUpAndDown) {
  JitteredRun link;
  link.jitterMs = [](std::mt19937& random, double ms) {
    return ms > 11'000 && ms < 21'000 ? std::uniform_real_distribution<>(0, 60)(random) : 0.0;
  };
  const std::vector<JitteredRun::Shown> shown = link.run(30);
  const auto delayAt = [&](double ms) {
    return std::find_if(shown.begin(), shown.end(), [&](const auto& one) { return one.ms >= ms; })->delayMs;
  };
  EXPECT_NEAR(delayAt(10'900), 40, 0.1);
  EXPECT_GE(delayAt(20'900), 40 + 0.9 * 60);
  EXPECT_LE(delayAt(20'900), 40 + 60);
  EXPECT_NEAR(delayAt(30'900), 40, 0.1);
}

TEST(PlayOut, KeepsDelayDuringAPause) {
  JitteredRun link;
  link.jitterMs = [](std::mt19937&, double) { return 0.0; };
  link.sends = [](double ms) { return ms < 5000 || ms > 8000; };
  const std::vector<JitteredRun::Shown> shown = link.run(10);
  for (const JitteredRun::Shown& one : shown) {
    if (one.ms > 2000) {
      ASSERT_NEAR(one.delayMs, 40, 0.1) << one.ms;
    }
  }
}

TEST(PlayOut, AllowsForDisplayTimesAheadOfNow) {
  JitteredRun link;
  link.aheadMs = 35;
  link.jitterMs = [](std::mt19937& random, double) { return std::uniform_real_distribution<>(0, 5)(random); };
  const std::vector<JitteredRun::Shown> shown = link.run(10);
  std::size_t inTime = 0, counted = 0;
  for (const JitteredRun::Shown& one : shown) {
    if (one.ms < 4000) continue;
    ++counted;
    inTime += isInTime(one);
  }
  EXPECT_GE(static_cast<double>(inTime), 0.96 * static_cast<double>(counted));
  EXPECT_NEAR(shown.back().delayMs, 10 + 30 + 5 + 35, 1);
}

}  // namespace
}  // namespace clothstream::client
