// SPDX-License-Identifier: MIT
#include "server/stream/turns.h"

#include <algorithm>

namespace clothstream::stream {
namespace {

// Ticks over which a cost is averaged.
constexpr int kAverage = 8;

bool isLong(const Turn& turn, std::span<Turn* const> turns) {
  return std::ranges::any_of(turns, [&](const Turn* other) {
    return other != &turn && other->running && turn.cost > other->pacer.period();
  });
}

}  // namespace

void Turn::took(Clock::duration time, Clock::time_point now) {
  cost = cost == Clock::duration::zero() ? time : cost + (time - cost) / kAverage;
  ended = now;
}

void chooseTurns(std::span<Turn* const> turns, Clock::time_point now, std::vector<Turn*>& chosen) {
  chosen.clear();
  Turn* nextLong = nullptr;
  Clock::duration longest{};
  const auto count = std::ranges::count_if(turns, &Turn::running);
  for (Turn* turn : turns) {
    turn->spare = {};
    if (!turn->running) continue;
    const bool due = turn->pacer.due() <= now;
    if (!isLong(*turn, turns)) {
      if (due) chosen.push_back(turn);
      continue;
    }
    longest = std::max(longest, turn->cost);
    if (due && (nextLong == nullptr || turn->pacer.due() < nextLong->pacer.due())) nextLong = turn;
  }
  std::ranges::sort(chosen, {}, [](const Turn* turn) { return turn->pacer.due(); });
  // Twice, for one may take longer than they did of late.
  for (Turn* turn : turns)
    if (!isLong(*turn, turns)) turn->spare = std::min<Clock::duration>(2 * longest, kMostSpare);
  if (nextLong != nullptr && (chosen.empty() || now - nextLong->ended >= count * nextLong->cost))
    chosen.push_back(nextLong);
}

}  // namespace clothstream::stream
