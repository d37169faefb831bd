// SPDX-License-Identifier: MIT
#include "server/stream/turns.h"

#include <algorithm>
#include <utility>

namespace clothstream::stream {
namespace {

// Ticks over which a cost is averaged.
constexpr int kAveragedTicks = 8;

// What others have between two of their ticks, at the least.
class Periods {
 public:
  explicit Periods(std::span<Turn* const> turns) {
    for (const Turn* turn : turns) {
      if (!turn->running) continue;
      const Clock::duration period = turn->pacer.period();
      if (period < shortest_) {
        next_ = std::exchange(shortest_, period);
        quickest_ = turn;
      } else {
        next_ = std::min(next_, period);
      }
    }
  }
  bool isLong(const Turn& turn) const { return turn.cost > (&turn == quickest_ ? next_ : shortest_); }

 private:
  Clock::duration shortest_ = Clock::duration::max(), next_ = Clock::duration::max();
  const Turn* quickest_ = nullptr;
};

}  // namespace

void Turn::took(Clock::duration time, Clock::time_point now) {
  cost = cost == Clock::duration::zero() ? time : cost + (time - cost) / kAveragedTicks;
  ended = now;
}

void chooseTurns(std::span<Turn* const> turns, Clock::time_point now, std::vector<Turn*>& chosen) {
  chosen.clear();
  const Periods periods(turns);
  Turn* nextLong = nullptr;
  Clock::duration longest{};
  const auto count = std::ranges::count_if(turns, &Turn::running);
  for (Turn* turn : turns) {
    turn->spare = {};
    if (!turn->running) continue;
    const bool due = turn->pacer.due() <= now;
    if (!periods.isLong(*turn)) {
      if (due) chosen.push_back(turn);
      continue;
    }
    longest = std::max(longest, turn->cost);
    if (due && (nextLong == nullptr || turn->pacer.due() < nextLong->pacer.due())) nextLong = turn;
  }
  std::ranges::sort(chosen, {}, [](const Turn* turn) { return turn->pacer.due(); });
  // Twice, for one may take longer than they did of late.
  for (Turn* turn : turns)
    if (!periods.isLong(*turn)) turn->spare = std::min<Clock::duration>(2 * longest, kMostSpare);
  if (nextLong != nullptr && (chosen.empty() || now - nextLong->ended >= count * nextLong->cost))
    chosen.push_back(nextLong);
}

}  // namespace clothstream::stream
