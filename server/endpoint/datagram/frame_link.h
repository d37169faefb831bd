// SPDX-License-Identifier: MIT
// Frames and input of one peer in the payloads of datagrams, and the way back to the stream.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "proto/datagram/input_bundle.h"
#include "server/endpoint/datagram/frame_sender.h"
#include "server/endpoint/datagram/shared_pieces.h"
#include "server/hosting/datagram_gate.h"
#include "server/telemetry/metrics.h"

namespace clothstream::endpoint {

// While the path is open, frames leave by datagrams. When the peer's receipts stop
// (FrameSender::silent), they leave by the stream again. A single packet then probes the path after
// kFirstPause, and again after pauses that double up to kLongestPause; frames return when one is received. A
// new address of the peer is probed at once.
//
// Not thread-safe. Reads no clock.
class FrameLink {
 public:
  static constexpr std::chrono::seconds kFirstPause{2}, kLongestPause{60};
  // Interval of LinkOutlet::setLink() while frames are sent.
  static constexpr std::chrono::milliseconds kUpdateInterval{20};

  // `wake` as for LinkOutlet::setFrameWake(), `headerBytes` as for FrameSender. `pieces` and `metrics` must
  // outlive the link.
  FrameLink(hosting::DatagramPeer peer, std::function<void()> wake, std::uint32_t headerBytes,
            SharedPieces& pieces, telemetry::DatagramMetrics& metrics);
  // Frames leave by the stream again.
  ~FrameLink();
  FrameLink(const FrameLink&) = delete;
  FrameLink& operator=(const FrameLink&) = delete;

  // Handles a payload of any bytes from the peer. Nothing is sent before advance().
  void receive(std::span<const std::byte> payload, Clock::time_point now);

  // Sends a payload. `last`: no other one follows at once.
  using Send = std::function<void(std::span<const std::byte> payload, bool last)>;
  // Does what is due. `open`: payloads can be sent. Call it at nextTime(), after receive(), when `open`
  // changes, and when the peer's outlet has something.
  void advance(bool open, Clock::time_point now, const Send& send);
  Clock::time_point nextTime() const;
  // The peer has a new address. What is known of the old path is forgotten (RFC 9000, section 9.4): packets
  // on it must not keep frames back. A silent path is probed now, and again after kFirstPause.
  void peerMoved(Clock::time_point now);

  const hosting::DatagramPeer& peer() const { return peer_; }

 private:
  enum class State : std::uint8_t { closed, used, silent };

  void enter(State state, Clock::time_point now);
  void updateLink(Clock::time_point now);
  void takeFrames(Clock::time_point now);

  const hosting::DatagramPeer peer_;
  SharedPieces& pieces_;
  telemetry::DatagramMetrics& metrics_;
  FrameSender sender_;
  datagram::InputReceiver input_;
  State state_ = State::closed;
  Clock::time_point since_{};    // beginning of the state
  Clock::time_point updated_{};  // newest update of the outlet
  Clock::time_point sent_{};     // newest frame
  Clock::time_point probeAt_{};
  Clock::duration pause_ = kFirstPause;  // before probeAt_
};

}  // namespace clothstream::endpoint
