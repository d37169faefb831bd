// SPDX-License-Identifier: MIT
// Congestion control for the datagrams of one peer, from delay and loss.
#pragma once

#include <cstdint>
#include <optional>

#include "server/delivery/cubic_window.h"
#include "server/delivery/queue_delay.h"
#include "server/delivery/recent_minimum.h"
#include "server/delivery/sent_packets.h"
#include "server/schedule/clock.h"

namespace clothstream::delivery {

using schedule::Clock;

// A window limits the bytes in flight, as in SCReAM (RFC 8298; version 2 is
// draft-johansson-ccwg-rfc8298bis-screamv2-06, cited as SCReAMv2). A frame may start while there is room and
// then leaves as a whole, so that the bytes in flight are around the window.
//
// Alone, or with flows of the same kind, the controller keeps the queue short:
// - The window grows with each acknowledged byte: by kGrowth * sqrt(segment * window) in a round trip, a
//   binomial increase (Bansal and Balakrishnan, INFOCOM 2001, section 2), which converges to equal shares.
// - When the filtered queue delay passes kTarget, one cut takes the window below the bandwidth-delay product,
//   so that the queue drains and everyone sees the base delay. The product follows from the rate of arrival,
//   as in RFC 8698, section 4.3, and from the present delay.
// - If the path has been idle for kQuiet and the window is not close to the one of the newest cut, it grows
//   by the factor of RFC 8698, section 4.3 (accelerated ramp-up), which bounds the queue that growth causes.
//
// Some flows fill every buffer and leave nothing to a flow that yields (SCReAMv2, "Competing Flows
// Compensation"). If the queue has not drained kPatience round trips after a cut, such a flow is there. The
// window returns to its size before the cut and follows CUBIC (RFC 9438), and thus gets the share that a TCP
// flow gets. The controller then tests with a cut whether the other flow has gone. The tests are at multiples
// of their interval on the server's clock, so that peers of one server that share a bottleneck test together.
//
// Loss counts as congestion together with a queue that stands. Without one, a loss of up to kRadioLoss is
// taken for radio loss, which parity repairs; more than that, by four standard deviations, is taken for a
// policer.
//
// The window never grows beyond 1.5 times what was in flight, so growth is validated (RFC 7661). A stream
// whose quality the link has lowered therefore needs more bytes before a finer quality is tried: the sender
// adds parity rows to its frames as far as there is room (Mailbox::wantsFinerQuality()). They are the only
// padding.
//
// Not thread-safe. Reads no clock. Times are in seconds, sizes in bytes, rates in bytes/s.
class RateController {
 public:
  // The path is silent if no receipt has come for this long, although packets of more than one frame await
  // one. It also bounds the round trips with which datagrams work at all.
  static constexpr Clock::duration kSilence = SentPackets::kLongest;
  // Filtered queue delay at which the window is cut, s.
  static constexpr double kTarget = 0.012;
  // Share of lost packets up to which loss without a queue is taken for radio loss.
  static constexpr double kRadioLoss = 0.1;

  RateController();

  // Records a packet when it leaves. Numbers are consecutive, modulo 2^32. `bytes` includes all headers.
  void sent(std::uint32_t number, std::uint32_t bytes, Clock::time_point now);
  // Applies a receipt: packet `newest` arrived at `arrivalUs` (microseconds on the client's clock, which
  // wrap), and packet newest - 1 - i if bit i of `mask` is set. The client sends one at once when the first
  // packet of a newer frame arrives, because this packet has no queue of its frame before it, and within 20
  // ms of any other packet. Receipts may be lost, late or repeated. Returns false, and does nothing, if
  // `newest` is later than the newest packet: the peer violates the protocol.
  [[nodiscard]] bool received(std::uint32_t newest, std::uint32_t arrivalUs, std::uint64_t mask,
                              Clock::time_point now);

  // Returns whether a frame may start. `waiting`: bytes that wait in the pacer.
  bool hasRoom(std::uint64_t waiting, Clock::time_point now);
  // Rate that the path carries, parity included.
  double rate() const { return window_ / (controlTime() + delay_.filtered()); }
  // Rate for the pacer. It is close to the path's, so that a frame causes hardly any queue.
  double pace() const { return 1.25 * rate(); }
  // Time for which packets may leave at once, because a wake for each costs more than to send it. 0 while
  // frames need the whole window or there is a queue: the path may then carry no more than the pace.
  Clock::duration quantum() const {
    return mayGrow() || isQueued() ? Clock::duration::zero() : std::chrono::milliseconds(4);
  }

  bool silent(Clock::time_point now) const {
    return awaited_ && awaitsSeveral() && now - *awaited_ >= kSilence;
  }
  double queueDelay() const { return delay_.filtered(); }
  // Minimum of the last 30 s, and smoothed as in RFC 6298. 0 before the first receipt.
  double minimumRoundTrip() const { return roundTrip_ ? 1e-6 * static_cast<double>(shortest_.value()) : 0; }
  double smoothedRoundTrip() const { return roundTrip_.value_or(0); }
  const LossMeter& loss() const { return packets_.loss(); }
  std::uint64_t lostPackets() const { return packets_.lost(); }
  // Another flow fills the buffer of the bottleneck.
  bool competes() const { return competition_.has_value(); }

 private:
  // Packets from a number to the first one that was sent after its arrival, as long as a round trip.
  struct Round {
    std::uint32_t end = 0;
    double flight = 0;  // largest
    std::uint32_t settled = 0, lost = 0;
  };
  // A cut whose effect is not known yet.
  struct Cut {
    std::uint32_t begin = 0;       // first packet after the cut
    std::optional<Round> round{};  // nothing until that packet has arrived
    Clock::time_point roundBegin{};
    double shortestQueue = 0;  // in the round
    int unanswered = 0;        // rounds
  };
  struct Competition {
    CubicWindow window;
    Clock::duration interval;  // of tests
    Clock::time_point test{};
    Clock::time_point queued{};  // newest time at which there was a queue
    std::uint32_t reduced = 0;   // first packet after the newest reduction
  };

  // Packets of more than one frame are newer than the newest one that is known to have arrived. The last
  // packets before a pause may be lost, which says nothing about the path.
  bool awaitsSeveral() const;
  // Time between a change of the window and the first receipts that show it, without a queue.
  double controlTime() const;
  bool isQueued() const;
  bool queueStands(Clock::time_point now) const;
  void measure(const SentPackets::Report& report, std::uint32_t arrivalUs, Clock::time_point now);
  void yield(const SentPackets::Report& report, Clock::time_point now);
  void compete(const SentPackets::Report& report, double passed, Clock::time_point now);
  bool exceedsRadioLoss() const;
  // Part of the window that was in use in the last two rounds.
  double used() const;
  bool mayGrow() const;
  void grow(double bytes, Clock::time_point now);
  void reduce(double product);
  void cut(double product);
  void judgeCut(std::uint32_t newest, Clock::time_point now);
  void beginCompetition(Clock::time_point now);

  SentPackets packets_;
  QueueDelay delay_;
  RecentMinimum shortest_;           // round trip, us
  std::optional<double> roundTrip_;  // smoothed
  double delivery_ = 0;              // rate of arrival
  double window_;
  double lastProduct_ = 0;  // bandwidth-delay product at the newest cut
  double beforeCuts_ = 0;   // window before the first cut that has not drained the queue; 0 if none
  Round round_, before_;
  std::optional<Cut> cut_;
  std::optional<Competition> competition_;
  std::optional<Clock::time_point> awaited_;      // since then a receipt is due
  std::optional<Clock::time_point> receipt_;      // time of the newest one
  std::optional<Clock::time_point> answered_;     // time at which the newest packet in a receipt was sent
  Clock::time_point sent_{};                      // time of the newest packet
  Clock::time_point queued_{};                    // newest time at which there was a queue
  std::optional<Clock::time_point> queuedSince_;  // beginning of the present queue
};

}  // namespace clothstream::delivery
