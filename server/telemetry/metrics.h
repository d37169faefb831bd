// SPDX-License-Identifier: MIT
// What is counted and timed of a scene and of the server, and its table for people.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "server/telemetry/histogram.h"

namespace clothstream::telemetry {

// Thread-safe.
class Counter {
 public:
  void add(std::uint64_t amount = 1) { value_.fetch_add(amount, std::memory_order_relaxed); }
  std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

// All of it is recorded by whoever sees it happen, and read at any time.
struct SceneMetrics {
  // Seconds.
  Histogram tick;          // from a tick's start to its status on the CPU
  Histogram lateness;      // of a tick's start behind its due time
  Histogram deviceTotal;   // on the device, all stages of a tick
  StageHistograms device;  // on the device, each stage
  Histogram
      encode;  // from the tick's completion on the device to the packet, entropy coding and waiting for it
  Histogram send;           // from the packet to a endpoint taking it
  Histogram inputToPacket;  // from a pose's arrival to the packet that shows its effect

  Counter ticks;
  Counter lateTicks;         // started more than a quarter of a tick behind
  Counter slippedTicks;      // by which simulated time fell behind real time
  Counter frames;            // packets made
  Counter keyFrames;         // of these
  Counter packetBytes;       // of these, counted once whoever listens
  Counter skippedFrames;     // not recorded, each quality's: the encoder was behind
  Counter framesTaken;       // by endpoints, each subscriber's
  Counter framesDropped;     // not sent to a subscriber that was behind, each subscriber's
  Counter framesThinned;     // of temporal layers that a subscriber is not sent, each subscriber's
  Counter stepsDown;         // of subscribers to fewer layers or a coarser quality
  Counter stepsUp;           // and back
  Counter rollbacks;         // to the last good state
  Counter resets;            // to the start
  Counter crowdedBalls;      // of self-collision: lists too long, and balls that touch too many others
  Counter rejectedMessages;  // answered by an Error
  Counter joins;
};

struct ServerMetrics {
  Counter connections;
  Counter refusedConnections;
  Counter droppedConnections;  // silent, too slow, or abusive
  Counter rejectedMessages;    // answered by an Error before joining
  Counter deviceRebuilds;
};

// One line a histogram (count, p50, p90, p99, maximum in milliseconds) and one line of counters; stages that
// never happened are left out.
std::string table(const std::string& scene, const SceneMetrics& metrics);
std::string table(const ServerMetrics& metrics);

}  // namespace clothstream::telemetry
