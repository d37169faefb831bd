// SPDX-License-Identifier: MIT
// Counters and timings of scenes and of the server, and their report as text.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <string>

#include "server/telemetry/histogram.h"
#include "server/telemetry/refusal.h"
#include "server/telemetry/trace.h"

namespace clothstream::telemetry {

// Thread-safe, without ordering between counters.
class Counter {
 public:
  void add(std::uint64_t amount = 1) { value_.fetch_add(amount, std::memory_order_relaxed); }
  std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<std::uint64_t> value_{0};
};

// Any thread may count. "Per subscriber" counts an event once for each subscriber that it concerns.
struct SceneCounters {
  Counter ticks;
  Counter lateTicks;          // ticks that started more than a quarter of a period late
  Counter slippedTicks;       // ticks by which simulated time fell behind real time
  Counter frames;             // packets encoded
  Counter keyFrames;          // packets that are key frames
  Counter packetBytes;        // bytes of all packets, each counted once for all subscribers
  Counter skippedFrames;      // frames not encoded because the encoder was behind, per quality
  Counter framesTaken;        // frames taken by endpoints, per subscriber
  Counter datagramFrames;     // those of framesTaken that left in datagrams
  Counter framesDropped;      // frames not sent because the subscriber was behind, per subscriber
  Counter sentBytes;          // bytes of all messages that endpoints have taken, per subscriber
  Counter stepsDown;          // subscribers moved to a coarser quality
  Counter stepsUp;            // subscribers moved to a finer quality
  Counter overloadStepsDown;  // reductions of frames or substeps because the device was overloaded
  Counter overloadStepsUp;    // the opposite
  Counter rollbacks;          // returns to the last good state
  Counter resets;             // returns to the initial state
  Counter crowdedBalls;       // self-collision: full neighbour lists, and balls with too many contacts
  Counter rejectedMessages;   // messages answered by an Error
  Counter joins;
};

// Any thread may record and read.
struct SceneMetrics : SceneCounters {
  // Times in seconds.
  Histogram tick;          // from the start of a tick to its status on the CPU
  Histogram lateness;      // start of a tick behind its due time
  Histogram deviceTotal;   // all stages of a tick on the device
  StageHistograms device;  // each stage of a tick on the device
  Histogram encode;  // from the end of a tick on the device to its packet, with the wait for entropy coding
  Histogram send;    // from the packet to the moment an endpoint takes it
  Histogram inputToPacket;  // from the arrival of a pose to the packet that shows its effect

  Trace trace;
};

// Connection to NATS.
struct NatsMetrics {
  std::atomic<bool> connected{false};
  Counter published, publishedBytes, received, receivedBytes;
  Counter dropped;  // messages lost on this side: without connection, or because either side was too slow
  Counter refused;  // messages that do not belong to their stream
};

// Datagrams of all peers.
struct DatagramMetrics {
  std::atomic<std::uint64_t> peers{0};  // whose frames leave in datagrams now
  Counter packets, bytes;               // payloads with pieces, repeated ones too
  Counter repeats;                      // pieces that peers have requested
  Counter lost;                         // packets that have not arrived, as receipts show
  Counter fallbacks;                    // frames of a peer went back to its stream, because receipts stopped
};

struct ServerMetrics {
  void refuse(Refusal reason) { refusals[static_cast<std::size_t>(reason)].add(); }

  Counter connections;
  // Bytes of messages, answers and files that the endpoints have sent, without headers and encryption.
  Counter grpcBytes, webBytes;
  std::array<Counter, kRefusalNames.size()> refusals;  // by Refusal
  Counter droppedConnections;  // connections closed because they were silent, too slow or abusive
  Counter rejectedMessages;    // messages answered by an Error before the client joined
  Counter deviceRebuilds;
  Counter quarantines;  // scenes stopped because they harmed others
  NatsMetrics nats;
  DatagramMetrics datagrams;
};

// One line per histogram (count, p50, p90, p99 and maximum in milliseconds), then lines of counters.
// Histograms without records are left out.
std::string table(const std::string& scene, const SceneMetrics& metrics);
std::string table(const ServerMetrics& metrics);

}  // namespace clothstream::telemetry
