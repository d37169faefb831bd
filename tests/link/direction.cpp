// SPDX-License-Identifier: MIT
// Random numbers are functions of the packet's number, so that losses do not depend on timing.
#include "tests/link/direction.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

namespace clothstream::link {
namespace {

constexpr std::chrono::microseconds kBin{100};
constexpr std::uint64_t kMaxBin = 100'000;  // 10 s

// Uses of random numbers.
constexpr std::uint64_t kLoss = 1, kPeriod = 2, kJitter = 3;

Clock::duration inSeconds(double seconds) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

double secondsOf(Clock::duration time) {
  return std::chrono::duration<double>(time).count();
}

// One step of SplitMix64 (Steele, Lea and Flood, 2014).
std::uint64_t mix(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

std::optional<const char*> errorOf(const Conditions& conditions) {
  const Conditions& c = conditions;
  if (!(c.loss >= 0 && c.loss < 1)) return "the loss must be at least 0 and below 100 %";
  if (c.burstPackets != 0 && c.burstTime != Clock::duration(0))
    return "bursts have a length in packets or in time, not both";
  if (c.burstPackets != 0 && !(c.burstPackets >= 1)) return "bursts have at least one packet on average";
  // Between two bursts there is at least one packet.
  if (c.burstPackets != 0 && c.loss > c.burstPackets / (c.burstPackets + 1))
    return "such bursts are too short for this loss: at most N / (N + 1) of the packets can be lost";
  if (c.bytesPerSecond > 0 && !(c.queueBytes > 0)) return "a limited rate needs a queue";
  return std::nullopt;
}

void DelayHistogram::add(Clock::duration delay) {
  const auto bin = std::clamp<std::int64_t>(delay / kBin, 0, kMaxBin);
  const auto at = static_cast<std::size_t>(bin);
  if (counts_.size() <= at) counts_.resize(at + 1);
  ++counts_[at];
  ++samples_;
}

double DelayHistogram::percentile(double percent) const {
  const double rank = std::max(1.0, std::ceil(percent / 100 * static_cast<double>(samples_)));
  double below = 0;
  for (std::size_t bin = 0; bin < counts_.size(); ++bin) {
    below += static_cast<double>(counts_[bin]);
    if (below >= rank) return 1000 * secondsOf(static_cast<std::int64_t>(bin) * kBin);
  }
  return 0;
}

Direction::Direction(const Conditions& conditions, std::uint64_t number)
    : conditions_(conditions), number_(number) {
  assert(!errorOf(conditions));
}

double Direction::uniform(std::uint64_t use, std::uint64_t index) const {
  const std::uint64_t bits = mix(mix(mix(mix(conditions_.seed) + number_) + use) + index);
  return static_cast<double>(bits >> 11) * 0x1p-53;
}

// Gilbert's model: every packet is lost in one of two states. It changes with each packet, or with time.
bool Direction::isLost(Clock::time_point now) {
  const Conditions& c = conditions_;
  if (c.loss == 0) return false;
  if (c.burstTime == Clock::duration(0)) {
    const double draw = uniform(kLoss, statistics_.packets);
    if (c.burstPackets == 0) return draw < c.loss;
    const double begins = c.loss / (c.burstPackets * (1 - c.loss)), ends = 1 / c.burstPackets;
    return inBurst_ = inBurst_ ? draw >= ends : draw < begins;
  }
  if (!periodEnds_) {
    periodEnds_ = now;
    inBurst_ = true;  // the first period is a pause
  }
  while (*periodEnds_ <= now) {
    inBurst_ = !inBurst_;
    const double mean = secondsOf(c.burstTime) * (inBurst_ ? 1 : (1 - c.loss) / c.loss);
    *periodEnds_ += inSeconds(-mean * std::log1p(-uniform(kPeriod, periods_++)));
  }
  return inBurst_;
}

void Direction::enter(std::span<const std::byte> packet, Clock::time_point now) {
  const bool lost = isLost(now);
  const std::uint64_t number = statistics_.packets++;
  statistics_.bytes += packet.size();
  Clock::time_point sent = now;
  if (conditions_.bytesPerSecond > 0) {
    freeAt_ = std::max(freeAt_, now);
    const auto bytes = static_cast<double>(packet.size());
    if (secondsOf(freeAt_ - now) * conditions_.bytesPerSecond + bytes > conditions_.queueBytes) {
      ++statistics_.dropped;
      return;
    }
    freeAt_ += inSeconds(bytes / conditions_.bytesPerSecond);
    sent = freeAt_;
  }
  statistics_.queue.add(sent - now);
  // A packet that is lost has used the rate, as on a radio link.
  if (lost) {
    ++statistics_.lost;
    return;
  }
  Clock::time_point due =
      sent + conditions_.delay + inSeconds(secondsOf(conditions_.jitter) * uniform(kJitter, number));
  if (!conditions_.reorders) lastDue_ = due = std::max(due, lastDue_);
  waiting_.emplace(due, Packet{number, {packet.begin(), packet.end()}});
}

std::optional<Clock::time_point> Direction::next() const {
  if (waiting_.empty()) return std::nullopt;
  return waiting_.begin()->first;
}

std::vector<std::byte> Direction::leave() {
  assert(!waiting_.empty());
  Packet packet = std::move(waiting_.begin()->second);
  waiting_.erase(waiting_.begin());
  if (newestLeft_ && packet.number < *newestLeft_) ++statistics_.reordered;
  newestLeft_ = std::max(newestLeft_.value_or(0), packet.number);
  return std::move(packet.bytes);
}

}  // namespace clothstream::link
