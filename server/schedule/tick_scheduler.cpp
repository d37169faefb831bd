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

Clock::time_point dueOf(const TickSchedule* schedule) {
  return schedule->pacer.due();
}

// Time since which a guest waits for the device.
Clock::time_point waitsSince(const TickSchedule* guest) {
  return guest->begun ? guest->newestUse : std::max(guest->pacer.due(), guest->newestUse);
}

// Returns whether a long tick of one of `count` running scenes has waited as long as its equal share of the
// device allows.
bool hasWaited(const TickSchedule& schedule, std::int64_t count, Clock::time_point now) {
  return now - schedule.ended >= count * schedule.cost;
}

}  // namespace

void TickSchedule::tickEnded(Clock::duration time, Clock::time_point now) {
  cost = cost == Clock::duration::zero() ? time : cost + (time - cost) / kAveragedTicks;
  ended = now;
}

TickSchedule* TickScheduler::collectDue(std::span<TickSchedule* const> schedules, Clock::time_point now,
                                        std::vector<TickSchedule*>& due) {
  const Periods periods(schedules);
  TickSchedule* nextLong = nullptr;
  Clock::duration longest{};
  for (TickSchedule* schedule : schedules) {
    schedule->catchUp = {};
    if (!schedule->running || schedule->begun) continue;
    const bool isDue = schedule->pacer.due() <= now;
    if (!periods.isLong(*schedule)) {
      if (isDue) due.push_back(schedule);
      continue;
    }
    longest = std::max(longest, schedule->cost);
    if (isDue && (nextLong == nullptr || dueOf(schedule) < dueOf(nextLong))) nextLong = schedule;
  }
  std::ranges::sort(due, {}, dueOf);
  // Twice the average cost, because a single tick may take longer than the average.
  for (TickSchedule* schedule : schedules)
    if (!periods.isLong(*schedule)) schedule->catchUp = std::min<Clock::duration>(2 * longest, kMaxCatchUp);
  return nextLong;
}

void TickScheduler::chooseAmongEquals(std::span<TickSchedule* const> schedules, Clock::time_point now,
                                      std::vector<TickSchedule*>& chosen) {
  TickSchedule* const nextLong = collectDue(schedules, now, chosen);
  if (nextLong == nullptr) return;
  const auto count = std::ranges::count_if(schedules, &TickSchedule::running);
  if (chosen.empty() || hasWaited(*nextLong, count, now)) chosen.push_back(nextLong);
}

void TickScheduler::observe(std::span<const TickSchedule* const> schedules, Clock::time_point now) {
  own_ = guests_ = 0;
  Clock::time_point nextDue = Clock::time_point::max();
  for (const TickSchedule* schedule : schedules) {
    if (!schedule->running) continue;
    ++(schedule->guest ? guests_ : own_);
    if (!schedule->guest) nextDue = std::min(nextDue, schedule->begun ? now : schedule->pacer.due());
  }
  gap_ = nextDue - std::min(now, nextDue);
  if (now > now_) excess_ = std::max(excess_ - (now - now_) / (own_ + 1), -slice_);
  now_ = std::max(now_, now);
}

void TickScheduler::choose(std::span<TickSchedule* const> schedules, Clock::time_point now,
                           std::vector<TickSchedule*>& chosen) {
  observe(schedules, now);
  chosen.clear();
  if (own_ == 0) return chooseAmongEquals(schedules, now, chosen);
  ownSchedules_.clear();
  guestSchedules_.clear();
  for (TickSchedule* schedule : schedules)
    (schedule->guest ? guestSchedules_ : ownSchedules_).push_back(schedule);
  chooseAmongEquals(ownSchedules_, now, chosen);
  if (guests_ == 0) return;
  for (TickSchedule* schedule : ownSchedules_)
    schedule->catchUp = std::min<Clock::duration>(std::max(schedule->catchUp, 2 * slice_), kMaxCatchUp);
  chooseGuests(now, chosen);
}

void TickScheduler::chooseGuests(Clock::time_point now, std::vector<TickSchedule*>& chosen) {
  waiting_.clear();
  TickSchedule* const nextLong = collectDue(guestSchedules_, now, waiting_);
  const bool longWaits = nextLong != nullptr && !waiting_.empty() && !hasWaited(*nextLong, guests_, now);
  if (nextLong != nullptr && !longWaits) waiting_.push_back(nextLong);
  for (TickSchedule* guest : guestSchedules_)
    if (guest->begun) waiting_.push_back(guest);
  if (waiting_.empty()) return;
  std::ranges::sort(waiting_, {}, waitsSince);

  Clock::duration room = std::max(gap_, -excess_);
  const auto turn = std::ranges::find_if(waiting_, [&](const TickSchedule* guest) {
    return excess_ <= Clock::duration::zero() || entitledFrom(*guest) <= now_;
  });
  if (turn != waiting_.end() && expectedUse(**turn) > room) {
    // Nothing else fits next to it.
    if (!(*turn)->begun) chosen.push_back(*turn);
    return;
  }
  bool anyFits = false, sliceFollows = false;  // at most one slice of a tick that has begun follows
  for (TickSchedule* guest : waiting_) {
    const Clock::duration use = expectedUse(*guest);
    if (use > room || (guest->begun && std::exchange(sliceFollows, true))) continue;
    room -= use;
    anyFits = true;
    if (!guest->begun) chosen.push_back(guest);
  }
  if (longWaits && !anyFits && earliest(*nextLong) <= now_) chosen.push_back(nextLong);
}

Clock::duration TickScheduler::expectedUse(const TickSchedule& guest) const {
  const bool isShort = guest.cost > Clock::duration::zero() && guest.cost < slice_;
  return isShort ? guest.cost : std::max(slice_, guest.longestUse);
}

Clock::time_point TickScheduler::entitledFrom(const TickSchedule& guest) const {
  return waitsSince(&guest) + expectedUse(guest) * guests_ * (own_ + 1);
}

Clock::time_point TickScheduler::earliest(const TickSchedule& schedule) const {
  if (!schedule.running || !schedule.guest) return now_;
  if (excess_ <= Clock::duration::zero() || expectedUse(schedule) <= gap_) return now_;
  return std::max(now_, std::min(now_ + excess_ * (own_ + 1), entitledFrom(schedule)));
}

Clock::duration TickScheduler::shareOf(const TickSchedule& schedule) const {
  const std::int64_t parts =
      schedule.guest ? (own_ + 1) * std::max<std::int64_t>(guests_, 1) : std::max<std::int64_t>(own_, 1);
  return schedule.pacer.period() / parts;
}

void TickScheduler::used(TickSchedule& schedule, Clock::duration time) {
  if (!schedule.guest) return;
  excess_ = std::min<Clock::duration>(excess_ + time, kMaxCatchUp);
  schedule.longestUse = std::max(time, schedule.longestUse - schedule.longestUse / kAveragedTicks);
  lastUse_ = std::max(lastUse_, now_) + time;
  schedule.newestUse = lastUse_;
}

}  // namespace clothstream::schedule
