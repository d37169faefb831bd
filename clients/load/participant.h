// SPDX-License-Identifier: MIT
// Somebody in a scene who moves a hand, and measures what comes.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "clients/core/core.h"
#include "clients/core/stream/frame_feedback.h"
#include "clients/grpc/failure.h"
#include "clients/load/link.h"
#include "clients/load/pose_timing.h"
#include "clothstream/v1/session.pb.h"
#include "proto/codec/packet_header.h"

namespace clothstream::load {

using Clock = std::chrono::steady_clock;

struct ParticipantOptions {
  std::string scene, name;
  bool decodes = true;  // else frames are acknowledged unread, but for their headers
  bool moves = true;    // a sphere, as told with each step(); from here on its orbit:
  double phase = 0;     // turns
  // Reads no faster than this; 0: as it comes.
  double bytesPerSecond = 0;
};

// Of one participant since its figures were taken last, or of several together.
struct Figures {
  std::uint64_t frames = 0, bytes = 0;  // of packets
  std::uint64_t dropped = 0;            // frames of the stream that never came, by the gaps in their ticks
  // Packets that the decoder refused; of who does not decode, whose reference never came.
  std::uint64_t decodeErrors = 0;
  std::uint64_t hashMismatches = 0;
  // ms of each frame, on the server's clock: from the packet's completion, and from the start of its tick's
  // simulation, to its arrival here.
  std::vector<float> ages, tickAges;
  // Of who moves and decodes.
  PoseTimes poses;

  void add(const Figures& other);
};

class Participant final : private LinkListener {
 public:
  Participant(Links& links, const ParticipantOptions& options);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  // To be called at the rate at which it is to send poses.
  void step(Clock::time_point now);
  void leave();

  bool joined() const;
  // Why the link is gone, once it is.
  std::optional<Failure> ended() const;
  Figures take();

 private:
  void received(std::span<const std::byte> message) override;
  void closed(const std::string& why) override;
  bool timesPoses() const { return options_.moves && options_.decodes; }
  void frameReceived(const v1::Frame& frame, std::uint64_t nowUs);
  // The core has just decoded it.
  void frameDecoded(const v1::Frame& frame);
  void count(const codec::PacketHeader& header);
  void move(std::uint64_t nowUs);
  void flush();

  const ParticipantOptions options_;
  mutable std::mutex mutex_;
  std::unique_ptr<cs_client, void (*)(cs_client*)> core_;
  v1::ServerMessage message_;
  client::Acknowledgement acknowledgement_;  // of who does not decode
  Figures figures_;
  std::uint64_t decodeErrorsTaken_ = 0, hashMismatchesTaken_ = 0;
  PoseTiming poseTiming_;
  std::uint64_t decodedTickUs_ = 0;  // when the newest decoded frame's began, on the server's clock; 0: none
  // The newest, by number: what frames can refer to.
  std::array<std::uint64_t, 64> ticks_{};
  std::uint64_t frames_ = 0;
  Clock::time_point readsAgainAt_{};
  bool readLater_ = false;
  std::optional<Failure> ended_;
  std::unique_ptr<Link> link_;
};

}  // namespace clothstream::load
