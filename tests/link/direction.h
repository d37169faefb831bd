// SPDX-License-Identifier: MIT
// One direction of a bad network link, without sockets and without a clock: packets enter, wait, and leave.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

namespace clothstream::link {

using Clock = std::chrono::steady_clock;

struct Conditions {
  Clock::duration delay{0};   // of every packet
  Clock::duration jitter{0};  // added to the delay, uniform from 0 to this
  bool reorders = false;      // whether jitter may change the order of packets
  double loss = 0;            // share of the packets that are lost, 0 to below 1
  // Losses come in bursts, in which every packet is lost, with the mean length `burstTime` or, if that is 0,
  // `burstPackets`, which is 1 or more. If both are 0, losses are independent.
  double burstPackets = 0;
  Clock::duration burstTime{0};
  double bytesPerSecond = 0;  // of IP packets; 0: unlimited
  // Bytes that may wait for the limited rate or are being sent. A packet that finds no room is dropped.
  double queueBytes = 0;
  std::uint64_t seed = 1;
};

// Text of what is wrong with conditions, or nothing.
std::optional<const char*> errorOf(const Conditions& conditions);

// Counts durations in steps of 0.1 ms. Longer ones than 10 s count as 10 s.
class DelayHistogram {
 public:
  void add(Clock::duration delay);
  // Nearest-rank percentile, ms; 0 without samples.
  double percentile(double percent) const;

 private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t samples_ = 0;
};

struct Statistics {
  std::uint64_t packets = 0, bytes = 0;  // that entered
  std::uint64_t lost = 0;
  std::uint64_t dropped = 0;    // because the queue was full
  std::uint64_t reordered = 0;  // left after a packet that had entered later (RFC 4737, section 3.3)
  DelayHistogram queue;         // time until a packet was sent at the limited rate
};

// The n-th packet that enters is lost or not whenever it enters, except in bursts with a mean duration. These
// begin and end at fixed times after the first packet.
class Direction {
 public:
  // `number`: directions with the same seed and other numbers have other losses. `errorOf(conditions)` must
  // be nothing.
  Direction(const Conditions& conditions, std::uint64_t number);

  void enter(std::span<const std::byte> packet, Clock::time_point now);
  // Time when the next packet leaves; nothing if the link is empty.
  std::optional<Clock::time_point> next() const;
  // Takes the packet that next() is about. The link must not be empty.
  std::vector<std::byte> leave();

  const Statistics& statistics() const { return statistics_; }

 private:
  struct Packet {
    std::uint64_t number;
    std::vector<std::byte> bytes;
  };

  bool isLost(Clock::time_point now);
  // Uniform in [0, 1). The same for the same seed, direction, use and index.
  double uniform(std::uint64_t use, std::uint64_t index) const;

  const Conditions conditions_;
  const std::uint64_t number_;
  std::multimap<Clock::time_point, Packet> waiting_;  // by the time when they leave
  bool inBurst_ = false;
  std::uint64_t periods_ = 0;                    // bursts and pauses so far; used with burstTime
  std::optional<Clock::time_point> periodEnds_;  // end of the current one; used with burstTime
  Clock::time_point freeAt_{};                   // when the limited rate has sent what it has
  Clock::time_point lastDue_{};
  std::optional<std::uint64_t> newestLeft_;
  Statistics statistics_;
};

}  // namespace clothstream::link
