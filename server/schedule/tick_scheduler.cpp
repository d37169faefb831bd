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

// Chooses among scenes of equal rights, and appends to `chosen`.
void chooseAmongEquals(std::span<TickSchedule* const> schedules, Clock::time_point now,
                       std::vector<TickSchedule*>& chosen) {
  const Periods periods(schedules);
  TickSchedule* nextLong = nullptr;
  Clock::duration longest{};
  const auto count = std::ranges::count_if(schedules, &TickSchedule::running);
  for (TickSchedule* schedule : schedules) {
    schedule->catchUp = {};
    if (!schedule->running || schedule->begun) continue;
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

}  // namespace

void TickSchedule::tickEnded(Clock::duration time, Clock::time_point now) {
  cost = cost == Clock::duration::zero() ? time : cost + (time - cost) / kAveragedTicks;
  ended = now;
}

Clock::duration shareOf(const TickSchedule& schedule, std::span<const TickSchedule* const> schedules) {
  std::int64_t own = 0, guests = 0;
  for (const TickSchedule* other : schedules)
    if (other->running) ++(other->guest ? guests : own);
  if (!schedule.guest) return schedule.pacer.period() / std::max<std::int64_t>(own, 1);
  return schedule.pacer.period() / ((own + 1) * std::max<std::int64_t>(guests, 1));
}

void TickScheduler::choose(std::span<TickSchedule* const> schedules, Clock::time_point now,
                           std::vector<TickSchedule*>& chosen) {
  chosen.clear();
  std::vector<TickSchedule*> own, guests;
  for (TickSchedule* schedule : schedules) (schedule->guest ? guests : own).push_back(schedule);
  if (std::ranges::none_of(own, &TickSchedule::running)) return chooseAmongEquals(schedules, now, chosen);
  chooseAmongEquals(own, now, chosen);
  if (std::ranges::none_of(guests, &TickSchedule::running)) return;
  for (TickSchedule* schedule : own)
    schedule->catchUp = std::min<Clock::duration>(std::max(schedule->catchUp, 2 * slice_), kMaxCatchUp);
  std::vector<TickSchedule*> due;
  chooseAmongEquals(guests, now, due);
  if (!due.empty() && guestsFrom(schedules, now) <= now) chosen.push_back(due.front());
}

Clock::time_point TickScheduler::guestsFrom(std::span<TickSchedule* const> schedules, Clock::time_point now) {
  std::int64_t others = 0;
  Clock::time_point nextDue = Clock::time_point::max();
  Clock::duration gap{};  // that the next slice of a guest may need
  for (const TickSchedule* schedule : schedules) {
    if (!schedule->running) continue;
    if (schedule->guest) {
      const bool isShort = schedule->cost > Clock::duration::zero() && schedule->cost < slice_;
      gap = std::max(gap, isShort ? schedule->cost : std::max(slice_, longest_));
    } else {
      ++others;
      nextDue = std::min(nextDue, schedule->begun ? now : schedule->pacer.due());
    }
  }
  grant(now, others);
  if (others == 0 || excess_ <= Clock::duration::zero() || now + gap <= nextDue) return now;
  return now + excess_ * (others + 1);
}

void TickScheduler::used(const TickSchedule& schedule, Clock::duration time) {
  if (!schedule.guest) return;
  excess_ += time;
  longest_ = std::max(time, longest_ - longest_ / kAveragedTicks);
}

// Guests may save at most one slice of their share.
void TickScheduler::grant(Clock::time_point now, std::int64_t others) {
  if (now > granted_) excess_ = std::max(excess_ - (now - granted_) / (others + 1), -slice_);
  granted_ = std::max(granted_, now);
}

}  // namespace clothstream::schedule
