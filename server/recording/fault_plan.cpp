// SPDX-License-Identifier: MIT
// Chooses faults with the generator of the standard library, whose numbers are the same everywhere.
#include "server/recording/fault_plan.h"

#include <random>

namespace clothstream::recording {
namespace {

// Distributions of the standard library differ between implementations; a remainder does not.
std::chrono::milliseconds between(std::chrono::milliseconds shortest, std::chrono::milliseconds longest,
                                  std::uint64_t random) {
  const auto choices = static_cast<std::uint64_t>((longest - shortest).count()) + 1;
  return shortest + std::chrono::milliseconds(random % choices);
}

}  // namespace

Fault FaultPlan::at(std::uint64_t recordedTick) const {
  constexpr int kHalf = 32;
  std::seed_seq seeds{seed_, static_cast<std::uint32_t>(recordedTick),
                      static_cast<std::uint32_t>(recordedTick >> kHalf)};
  std::mt19937_64 random(seeds);
  const auto draw = static_cast<std::uint32_t>(random() % 1000);
  if (draw < kDropsIn1000) return {Fault::Kind::drop, {}};
  if (draw < kDropsIn1000 + kDelaysIn1000)
    return {Fault::Kind::delay, between(kShortestDelay, kLongestDelay, random())};
  if (draw < kDropsIn1000 + kDelaysIn1000 + kStallsIn1000)
    return {Fault::Kind::stall, between(kShortestStall, kLongestStall, random())};
  return {};
}

}  // namespace clothstream::recording
