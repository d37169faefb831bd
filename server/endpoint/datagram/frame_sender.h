// SPDX-License-Identifier: MIT
// Frames of one peer on their way into datagrams: pieces, parity, pacing, repeats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "proto/datagram/frame_pieces.h"
#include "proto/datagram/piece_request.h"
#include "proto/datagram/receipt.h"
#include "proto/datagram/sent_frames.h"
#include "server/delivery/link_outlet.h"
#include "server/delivery/packet_pacer.h"
#include "server/delivery/parity_policy.h"
#include "server/delivery/rate_controller.h"
#include "server/schedule/clock.h"

namespace clothstream::endpoint {

using schedule::Clock;

// Cuts nothing: the owner makes the pieces, which peers share. Not thread-safe. Reads no clock and sends
// nothing: the owner asks for datagrams with next().
class FrameSender {
 public:
  // `headerBytes`: bytes of each packet in addition to its datagram.
  explicit FrameSender(std::uint32_t headerBytes) : headerBytes_(headerBytes) {}

  // Number of parity rows with which a frame of this length is sent now. `probes`: rows fill the frame up to
  // LinkAdaptation::kProbe times its size, as far as the link has room.
  unsigned rowsFor(std::size_t frameBytes, bool probes, Clock::time_point now);
  // Queues the data pieces and the first `rows` parity pieces of a frame. Where losses come in bursts, the
  // parity leaves after the data of the next frame, or after 20 ms (ParityPolicy::defers()).
  void add(std::shared_ptr<const datagram::FramePieces> frame, unsigned rows, Clock::time_point now);
  // Queues the first piece of the newest frame once more, to find out whether packets arrive. Nothing without
  // a frame.
  void probe(Clock::time_point now);

  // Writes the next datagram that is due to `out`, which has at least datagram::kMaxDatagramBytes, and
  // returns its length. The datagram must then be sent. 0: nothing is due.
  std::size_t next(Clock::time_point now, std::span<std::byte> out);
  // Time at which next() has something; nothing if no packet waits.
  std::optional<Clock::time_point> due() const;

  // Queues the pieces that a request asks for. Returns their number.
  std::size_t answer(const datagram::PieceRequest& request, Clock::time_point now);
  // Returns the number of packets that are now known to be lost. Returns nothing, and does nothing, if the
  // receipt names a packet that was never sent.
  std::optional<std::uint64_t> acknowledge(const datagram::Receipt& receipt, Clock::time_point now);

  // State of the link for the outlet.
  delivery::LinkOutlet::Link link(Clock::time_point now);
  // No receipt has come for RateController::kSilence although packets were sent.
  bool silent(Clock::time_point now) const { return controller_.silent(now); }
  // A packet that was sent since forgetPath() has arrived.
  bool isHeard() const { return controller_.minimumRoundTrip() > 0; }
  // Drops what waits, and measures the path from the beginning.
  void forgetPath();

 private:
  struct Packet {
    std::shared_ptr<const datagram::FramePieces> frame;
    std::uint32_t number = 0;  // of the frame
    unsigned index = 0;
  };

  // Parity that waits: the pieces from `first` to before `end`.
  struct Deferred {
    Packet first;
    unsigned end = 0;
    Clock::time_point due{};
  };

  void queue(Packet first, unsigned end, Clock::time_point now);
  void queueDeferred(Clock::time_point now);
  // Bytes that have not left.
  std::uint64_t waiting() const;
  std::uint32_t packetBytes(const datagram::FramePieces& frame) const {
    return static_cast<std::uint32_t>(frame.datagramBytes()) + headerBytes_;
  }

  const std::uint32_t headerBytes_;
  delivery::RateController controller_;
  delivery::PacketPacer<Packet> pacer_;
  delivery::ParityPolicy parity_;
  datagram::SentFrames sent_;
  std::optional<Deferred> deferred_;
  std::optional<Packet> newest_;  // first piece of the newest frame
  std::uint32_t nextPacket_ = 0;
  double frameShare_ = 1;  // part of the newest frame's bytes on the wire that is the frame itself
};

}  // namespace clothstream::endpoint
