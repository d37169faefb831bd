// SPDX-License-Identifier: MIT
// A participant that moves a sphere and measures the frames it receives.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/stream/frame_feedback.h"
#include "clients/datagram/datagram_session.h"
#include "clients/load/link.h"
#include "clients/load/pose_timing.h"
#include "clients/native/failure.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"

namespace clothstream::load {

using Clock = std::chrono::steady_clock;

struct ParticipantOptions {
  std::string scene, name;
  std::string token;    // empty: none
  bool decodes = true;  // otherwise it reads only the packet headers
  bool moves = true;    // whether it moves a sphere on an orbit
  double phase = 0;     // start of the orbit, revolutions
  // Reading rate; 0: unlimited.
  double bytesPerSecond = 0;
  std::uint32_t maxVertices = 0;  // as in limitVertices
  bool keepsFrames = false;       // whether Figures::frameTimes has an entry for each frame
  // Opens its datagrams, and must outlive the participant. Null: no datagrams.
  DatagramHost* datagrams = nullptr;
  bool requiresDatagrams = false;  // it has joined when they are open
};

// A received frame. Ages are ms since its tick began, on the server's clock.
struct FrameTime {
  std::uint32_t participant = 0;  // as in the order of joining; set by the load test
  std::uint64_t tick = 0;
  Clock::time_point arrived;
  float age = 0;  // on arrival
  // When play-out can first show it. Only if the participant moves and decodes.
  std::optional<float> displayableAge;
};

// Figures of one participant since the last take(), or sums over several participants.
struct Figures {
  std::uint64_t frames = 0, bytes = 0;  // received packets
  std::uint64_t dropped = 0;            // missing frames, from the gaps between ticks
  // Frames that arrived more than a period of the stream after they were due, by the arrival of the frame
  // before.
  std::uint64_t late = 0;
  // Packets that the decoder refused. Without decoding: packets whose reference is missing.
  std::uint64_t decodeErrors = 0;
  std::uint64_t hashMismatches = 0;
  // Age of each frame on arrival, ms on the server's clock: since the packet was complete, and since its tick
  // began.
  std::vector<float> ages, tickAges;
  // Only if the participant moves and decodes.
  PoseTimes poses;
  std::vector<FrameTime> frameTimes;  // only with ParticipantOptions::keepsFrames

  void add(const Figures& other);
};

class Participant final : private LinkListener {
 public:
  Participant(Links& links, const ParticipantOptions& options);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  // Sends one pose. Call it at the rate of the poses.
  void step(Clock::time_point now);
  void leave();

  bool joined() const;
  // Reason why the link ended, or nothing while it is open.
  std::optional<Failure> ended() const;
  Figures take();
  // Nothing if datagrams were not open.
  std::optional<cs_datagram_statistics> datagrams() const;
  // Seconds from connecting to the first frame. Nothing before it.
  std::optional<double> firstFrameSeconds() const;
  // The same to the first frame that came in datagrams.
  std::optional<double> firstDatagramFrameSeconds() const;

 private:
  void received(std::span<const std::byte> message) override;
  void datagramsArrived();
  // The caller of the following holds the lock.
  void take(std::span<const std::byte> message);
  // Takes the messages that datagrams have brought, and sends what waits. Returns whether the stream must
  // end.
  bool proceed();
  void send(std::string message);
  void closed(const std::string& why) override;
  // Why the core has ended the stream.
  Failure refusal() const;
  bool timesPoses() const { return options_.moves && options_.decodes; }
  void frameReceived(const v1::Frame& frame, std::uint64_t nowUs);
  double secondsOpen() const { return std::chrono::duration<double>(Clock::now() - opened_).count(); }
  // Measures poses after the core has decoded the frame.
  void frameDecoded(const v1::Frame& frame);
  void count(const codec::PacketHeader& header, std::uint32_t frameDivisor);
  void move(std::uint64_t nowUs);
  void flush();

  const ParticipantOptions options_;
  const Clock::time_point opened_ = Clock::now();
  mutable std::mutex mutex_;
  std::unique_ptr<cs_client, void (*)(cs_client*)> core_;
  v1::ServerMessage message_;
  client::Acknowledgement acknowledgement_;  // used if it does not decode
  Figures figures_;
  std::uint64_t decodeErrorsTaken_ = 0, hashMismatchesTaken_ = 0;
  PoseTiming poseTiming_;
  std::uint64_t decodedTickUs_ = 0;          // start of the newest decoded tick, server's clock; 0: none
  std::optional<std::uint64_t> newestTick_;  // of the frames, to which the next one refers
  std::uint32_t frameDivisor_ = 1;           // of the newest frame
  Clock::time_point newestAt_;               // arrival of the newest frame
  std::optional<double> firstFrameSeconds_, firstDatagramFrameSeconds_;
  Clock::time_point readsAgainAt_{};
  bool readLater_ = false;
  std::optional<Failure> ended_;
  std::unique_ptr<Link> link_;
  std::unique_ptr<DatagramSession> datagrams_;  // null: none
};

}  // namespace clothstream::load
