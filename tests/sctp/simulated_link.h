// SPDX-License-Identifier: MIT
// Link between two ends in simulated time, which loses, repeats and delays packets.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "proto/sctp/sent_tsns.h"

namespace clothstream::sctp {

// Anything that sends and receives packets: an association, a channel, or usrsctp.
struct End {
  std::function<void(Time, std::span<const std::byte>)> receive;
  std::function<void(Time)> advance;
  std::function<Time()> deadline;
};

template <typename T>
End endOf(T& subject) {
  return {[&](Time now, std::span<const std::byte> packet) { subject.receive(now, packet); },
          [&](Time now) { subject.advance(now); }, [&] { return subject.deadline(); }};
}

class SimulatedLink {
 public:
  struct Faults {
    double loss = 0, duplication = 0;                          // parts of the packets
    Duration delay = std::chrono::milliseconds(10), jitter{};  // jitter changes the order
  };

  explicit SimulatedLink(const Faults& faults, std::uint32_t seed = 1) : faults_(faults), random_(seed) {}

  void attach(End first, End second) { ends_ = {std::move(first), std::move(second)}; }
  Time now() const { return now_; }

  // Loses every packet for which this returns true. Arguments: sending end, number of the packet of this end.
  std::function<bool(std::size_t from, std::size_t number)> losesToo;
  // Sees every packet that is sent, with its sender and whether it gets lost.
  std::function<void(std::size_t from, std::span<const std::byte> packet, bool isLost)> watch;

  void send(std::size_t from, std::span<const std::byte> packet) {
    const std::size_t number = sent_[from]++;
    const bool isLost = chance(faults_.loss) || (losesToo && losesToo(from, number));
    if (watch) watch(from, packet, isLost);
    if (isLost) return;
    for (int copies = chance(faults_.duplication) ? 2 : 1; copies > 0; --copies) {
      const auto extra = std::uniform_int_distribution<Duration::rep>(0, faults_.jitter.count())(random_);
      const Time arrival = now_ + faults_.delay + Duration(extra);
      underWay_.emplace(arrival, UnderWay{1 - from, {packet.begin(), packet.end()}});
    }
  }
  std::size_t sent(std::size_t from) const { return sent_[from]; }

  // Lets time pass. Both ends act when they want to, and packets arrive.
  void run(Duration duration) {
    const Time end = now_ + duration;
    for (;;) {
      Time next = std::min(ends_[0].deadline(), ends_[1].deadline());
      if (!underWay_.empty()) next = std::min(next, underWay_.begin()->first);
      if (next > end) break;
      now_ = std::max(now_, next);
      for (const End& each : ends_)
        if (each.deadline() <= now_) each.advance(now_);
      while (!underWay_.empty() && underWay_.begin()->first <= now_) {
        const UnderWay packet = std::move(underWay_.begin()->second);
        underWay_.erase(underWay_.begin());
        ends_[packet.to].receive(now_, packet.bytes);
      }
    }
    now_ = end;
  }

 private:
  struct UnderWay {
    std::size_t to = 0;
    std::vector<std::byte> bytes;
  };

  bool chance(double part) { return std::uniform_real_distribution<>(0, 1)(random_) < part; }

  const Faults faults_;
  std::mt19937 random_;
  std::array<End, 2> ends_;
  std::multimap<Time, UnderWay> underWay_;
  std::array<std::size_t, 2> sent_{};
  Time now_ = Time{} + std::chrono::hours(1);
};

}  // namespace clothstream::sctp
