// SPDX-License-Identifier: MIT
#include "server/delivery/parity_policy.h"

#include <algorithm>
#include <array>
#include <cassert>

namespace clothstream::delivery {
namespace {

constexpr std::uint32_t kMostRows = 16;
constexpr double kMostLoss = 0.5;
constexpr double kLower = 2.0 / 3;

}  // namespace

std::optional<std::uint32_t> rowsFor(const PacketLoss& loss, std::uint32_t k, double residual,
                                     std::uint32_t most, std::uint32_t apart) {
  assert(most <= kMostRows && loss.share >= 0 && loss.share < 1);
  // Probabilities that a packet is lost, after a lost one and after one that arrived.
  const double stays = std::max(1 - 1 / loss.burst, loss.share);
  const double enters = (1 - stays) * loss.share / (1 - loss.share);
  // Probability that `n` packets have arrived or been lost, i of them lost, and that the last one was lost.
  // More than `most` losses are not followed.
  std::array<double, kMostRows + 1> arrived{}, lost{};
  arrived[0] = 1 - loss.share;
  lost[0] = loss.share;
  const auto pass = [&] {
    for (std::uint32_t i = 0; i <= most; ++i) {
      const double stillLost = lost[i] * stays + arrived[i] * enters;
      arrived[i] += lost[i] - stillLost;
      lost[i] = stillLost;
    }
  };
  // The state before the first packet is the stationary one.
  for (std::uint32_t n = 1; n <= k + most; ++n) {
    for (std::uint32_t i = most + 1; i-- > 0;) {
      const double less = i > 0 ? lost[i - 1] * stays + arrived[i - 1] * enters : 0;
      arrived[i] = arrived[i] * (1 - enters) + lost[i] * (1 - stays);
      lost[i] = less;
    }
    if (n < k) continue;
    const std::uint32_t m = n - k;
    double decodable = 0;
    for (std::uint32_t i = 0; i <= m; ++i) decodable += arrived[i] + lost[i];
    if (1 - decodable <= residual) return m;
    for (std::uint32_t other = 0; m == 0 && other < apart; ++other) pass();
  }
  return std::nullopt;
}

void ParityPolicy::update(PacketLoss measured, Clock::time_point now) {
  measured.share = std::clamp(measured.share, kLeastLoss, kMostLoss);
  measured.burst = std::max(measured.burst, 1.0);
  if (measured.share < kLower * loss_.share) {
    if (!lowerSince_) lowerSince_ = now;
    if (now - *lowerSince_ < kHold) return;
  } else if (measured.share <= loss_.share) {
    lowerSince_.reset();
    loss_.burst = std::max(loss_.burst, measured.burst);
    return;
  }
  lowerSince_.reset();
  loss_ = measured;
}

std::uint32_t ParityPolicy::rows(std::uint32_t k) const {
  assert(k >= 1 && k <= 128);
  return rowsFor(loss_, k, kResidual, kMost, defers() ? k : 0).value_or(kMost);
}

}  // namespace clothstream::delivery
