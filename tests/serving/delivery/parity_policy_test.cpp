// SPDX-License-Identifier: MIT
#include "server/delivery/parity_policy.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::delivery {
namespace {

using namespace std::chrono_literals;

const Clock::time_point kStart{1h};

// Probability that more than m of k + m packets are lost, if losses are independent.
double binomialTail(double p, int k, int m) {
  const int n = k + m;
  double kept = 0;
  for (int i = 0; i <= m; ++i)
    kept += std::exp(std::lgamma(n + 1) - std::lgamma(i + 1) - std::lgamma(n - i + 1)) * std::pow(p, i) *
            std::pow(1 - p, n - i);
  return 1 - kept;
}

std::uint32_t rowsAt(double share, std::uint32_t k, double burst = 1) {
  ParityPolicy policy;
  policy.update({.share = share, .burst = burst}, kStart);
  return policy.rows(k);
}

TEST(ParityPolicy, AgreesWithTheBinomialFormula) {
  for (const double p : {0.001, 0.01, 0.05, 0.2})
    for (const int k : {1, 3, 7, 40, 128})
      for (const double residual : {0.1, 1e-2, 1e-4}) {
        std::optional<std::uint32_t> expected;
        for (int m = 0; m <= 8 && !expected; ++m)
          if (binomialTail(p, k, m) <= residual) expected = static_cast<std::uint32_t>(m);
        EXPECT_EQ(rowsFor({.share = p}, static_cast<std::uint32_t>(k), residual, 8), expected)
            << p << " " << k << " " << residual;
      }
}

// Counts frames that a simulated chain makes undecodable. The tolerance is four standard deviations.
TEST(ParityPolicy, AgreesWithSimulatedBursts) {
  constexpr int kFrames = 100'000;
  constexpr double kAllowed = 0.01;
  const PacketLoss loss{.share = 0.02, .burst = 3};
  const std::uint32_t k = 7;
  for (const std::uint32_t apart : {0u, 7u}) {
    const auto rows = rowsFor(loss, k, kAllowed, 8, apart);
    ASSERT_TRUE(rows);
    std::minstd_rand random(1);
    std::uniform_real_distribution<double> uniform;
    const auto undecodable = [&](std::uint32_t m) {
      int frames = 0;
      for (int frame = 0; frame < kFrames; ++frame) {
        std::uint32_t lost = 0;
        bool losing = uniform(random) < loss.share;
        for (std::uint32_t packet = 0; packet < k + apart + m; ++packet) {
          const bool isOther = packet >= k && packet < k + apart;
          lost += losing && !isOther ? 1 : 0;
          losing =
              uniform(random) < (losing ? 1 - 1 / loss.burst : loss.share / (1 - loss.share) / loss.burst);
        }
        frames += lost > m ? 1 : 0;
      }
      return static_cast<double>(frames) / kFrames;
    };
    const double tolerance = 4 * std::sqrt(kAllowed / kFrames);
    EXPECT_LE(undecodable(*rows), kAllowed + tolerance) << apart;
    EXPECT_GE(undecodable(*rows - 1), kAllowed - tolerance) << apart;
  }
}

struct Row {
  double loss;
  std::uint32_t small, large;
};

TEST(ParityPolicy, GivesPlausibleNumbersOfRows) {
  for (const Row& row : {Row{0.003, 1, 1}, Row{0.015, 2, 2}, Row{0.04, 3, 4}, Row{0.1, 4, 4}}) {
    EXPECT_EQ(rowsAt(row.loss, 3), row.small) << row.loss;
    EXPECT_EQ(rowsAt(row.loss, 7), row.large) << row.loss;
    std::printf("loss %4.1f %%: k = 3: %u rows, %.1f of 10,000 frames lost; k = 7: %u rows, %.1f\n",
                100 * row.loss, row.small, 1e4 * binomialTail(row.loss, 3, static_cast<int>(row.small)),
                row.large, 1e4 * binomialTail(row.loss, 7, static_cast<int>(row.large)));
  }
}

// With kMost rows, such bursts make 8 of 1,000 frames of two pieces undecodable, and 5 with deferred parity.
// Two deferred rows do as much as kMost at once.
TEST(ParityPolicy, DefersParityInBursts) {
  ParityPolicy policy;
  EXPECT_FALSE(policy.defers());
  policy.update({.share = 0.02, .burst = 4}, kStart);
  EXPECT_TRUE(policy.defers());
  const PacketLoss loss{.share = 0.02, .burst = 4};
  EXPECT_EQ(rowsFor(loss, 2, 0.0081, ParityPolicy::kMost), 4u);
  EXPECT_EQ(rowsFor(loss, 2, 0.0081, ParityPolicy::kMost, 2), 2u);
  EXPECT_FALSE(rowsFor(loss, 2, 0.005, ParityPolicy::kMost));
  EXPECT_EQ(rowsFor(loss, 2, 0.005, ParityPolicy::kMost, 2), 4u);
  EXPECT_EQ(policy.rows(7), ParityPolicy::kMost) << "what it cannot repair is requested";
}

TEST(ParityPolicy, NoticesBurstsAtTheSameLoss) {
  ParityPolicy policy;
  policy.update({.share = 0.02, .burst = 1}, kStart);
  policy.update({.share = 0.019, .burst = 4}, kStart + 1s);
  EXPECT_TRUE(policy.defers());
}

TEST(ParityPolicy, KeepsBounds) {
  ParityPolicy policy;
  EXPECT_EQ(policy.rows(3), 1u) << "no loss was measured yet";
  policy.update({.share = 1, .burst = 1e9}, kStart);
  EXPECT_EQ(policy.rows(128), ParityPolicy::kMost);
}

TEST(ParityPolicy, FollowsFallingLossLate) {
  ParityPolicy policy;
  policy.update({.share = 0.04}, kStart);
  EXPECT_EQ(policy.rows(3), 3u);
  policy.update({.share = 0.01}, kStart + 1s);
  policy.update({.share = 0.03}, kStart + 2s);
  policy.update({.share = 0.01}, kStart + 3s);
  policy.update({.share = 0.01}, kStart + 4900ms);
  EXPECT_EQ(policy.rows(3), 3u) << "it was not low for long";
  policy.update({.share = 0.01}, kStart + 5s);
  EXPECT_EQ(policy.rows(3), 2u);
  policy.update({.share = 0.04}, kStart + 5s);
  EXPECT_EQ(policy.rows(3), 3u);
}

}  // namespace
}  // namespace clothstream::delivery
