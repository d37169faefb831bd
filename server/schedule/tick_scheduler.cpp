// SPDX-License-Identifier: MIT
#include "server/schedule/tick_scheduler.h"

#include <algorithm>
#include <utility>

namespace clothstream::schedule {
namespace {

// Ticks over which the cost is averaged.
constexpr int kAveragedTicks = 8;

// Shortest periods of the running scenes.
class Periods {
 public:
  explicit Periods(std::span<TickSchedule* const> schedules) {
    for (const TickSchedule* schedule : schedules) {
      if (!schedule->running) continue;
      const Clock::duration period = schedule->pacer.period();
      if (period < shortest_) {
        second_ = std::exchange(shortest_, period);
        fastest_ = schedule;
      } else {
        second_ = std::min(second_, period);
      }
    }
  }
  // Returns whether a tick of this schedule takes longer than the period of another scene.
  bool isLong(const TickSchedule& schedule) const {
    return schedule.cost > (&schedule == fastest_ ? second_ : shortest_);
  }

 private:
  Clock::duration shortest_ = Clock::duration::max(), second_ = Clock::duration::max();
  const TickSchedule* fastest_ = nullptr;
};

}  // namespace

void TickSchedule::tickEnded(Clock::duration time, Clock::time_point now) {
  cost = cost == Clock::duration::zero() ? time : cost + (time - cost) / kAveragedTicks;
  ended = now;
}

void scheduleTicks(std::span<TickSchedule* const> schedules, Clock::time_point now,
                   std::vector<TickSchedule*>& chosen) {
  chosen.clear();
  const Periods periods(schedules);
  TickSchedule* nextLong = nullptr;
  Clock::duration longest{};
  const auto count = std::ranges::count_if(schedules, &TickSchedule::running);
  for (TickSchedule* schedule : schedules) {
    schedule->catchUp = {};
    if (!schedule->running) continue;
    const bool due = schedule->pacer.due() <= now;
    if (!periods.isLong(*schedule)) {
      if (due) chosen.push_back(schedule);
      continue;
    }
    longest = std::max(longest, schedule->cost);
    if (due && (nextLong == nullptr || schedule->pacer.due() < nextLong->pacer.due())) nextLong = schedule;
  }
  std::ranges::sort(chosen, {}, [](const TickSchedule* schedule) { return schedule->pacer.due(); });
  // Twice the average cost, because a single tick may take longer than the average.
  for (TickSchedule* schedule : schedules)
    if (!periods.isLong(*schedule)) schedule->catchUp = std::min<Clock::duration>(2 * longest, kMaxCatchUp);
  if (nextLong != nullptr && (chosen.empty() || now - nextLong->ended >= count * nextLong->cost))
    chosen.push_back(nextLong);
}

}  // namespace clothstream::schedule
