// SPDX-License-Identifier: MIT
// Computes gusts in integer arithmetic.
#include "server/model/wind.h"

#include <algorithm>
#include <cmath>

namespace clothstream::model {
namespace {

// Fixed-point 1 for noise and for fractions of a period.
constexpr std::int64_t kOne = 1 << 16;
constexpr std::uint64_t kFineTurns = 3;  // short periods per period

// Mixing function of SplitMix64: Steele, Lea and Flood, "Fast splittable pseudorandom number generators",
// 2014.
std::uint64_t mixed(std::uint64_t bits) {
  bits += 0x9E3779B97F4A7C15u;
  bits = (bits ^ (bits >> 30)) * 0xBF58476D1CE4E5B9u;
  bits = (bits ^ (bits >> 27)) * 0x94D049BB133111EBu;
  return bits ^ (bits >> 31);
}

// Hashed value from -kOne to kOne.
std::int64_t valueAt(std::uint64_t turn, std::uint64_t stream) {
  return static_cast<std::int64_t>(mixed(mixed(stream) ^ turn) % (2 * kOne + 1)) - kOne;
}

// Interpolates between the values of two consecutive periods.
std::int64_t noise(std::uint64_t tick, std::uint64_t ticksPerTurn, std::uint64_t stream) {
  const std::uint64_t turn = tick / ticksPerTurn;
  const auto part = static_cast<std::int64_t>((tick % ticksPerTurn) * kOne / ticksPerTurn);
  const std::int64_t smooth = part * part / kOne * (3 * kOne - 2 * part) / kOne;
  const std::int64_t from = valueAt(turn, stream), to = valueAt(turn + 1, stream);
  return from + (to - from) * smooth / kOne;
}

}  // namespace

Environment environmentAt(const Scene& scene, std::uint64_t tick) {
  Environment environment = scene.environment;
  environment.gust = {};
  const Gust& gust = scene.environment.gust;
  if (gust.strength == 0) return environment;
  const double ticks = std::round(double{gust.seconds} * scene.simulationRate);
  const auto turn = static_cast<std::uint64_t>(std::max(1.0, ticks));
  const std::uint64_t fineTurn = std::max<std::uint64_t>(1, turn / kFineTurns);
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const std::int64_t sum = (2 * noise(tick, turn, 2 * axis) + noise(tick, fineTurn, 2 * axis + 1)) / 3;
    environment.wind[axis] += gust.strength * (static_cast<float>(sum) / static_cast<float>(kOne));
  }
  return environment;
}

}  // namespace clothstream::model
