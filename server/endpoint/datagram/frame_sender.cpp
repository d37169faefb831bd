// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/frame_sender.h"

#include <algorithm>
#include <utility>

#include "server/delivery/link_adaptation.h"

namespace clothstream::endpoint {

using delivery::LinkAdaptation;
using delivery::RateController;

namespace {

// Parity that waits for the next frame leaves after this time at the latest.
constexpr std::chrono::milliseconds kLongestDelay{20};

}  // namespace

unsigned FrameSender::rowsFor(std::size_t frameBytes, bool probes, Clock::time_point now) {
  const auto pieces =
      static_cast<unsigned>((frameBytes + datagram::kMaxPayloadBytes - 1) / datagram::kMaxPayloadBytes);
  unsigned rows = parity_.rows(pieces);
  if (!probes) return rows;
  const std::size_t packet =
      datagram::kPieceHeaderBytes + datagram::payloadBytes(frameBytes, pieces) + headerBytes_;
  const auto most = std::min<unsigned>(datagram::kMaxParityPieces,
                                       static_cast<unsigned>((LinkAdaptation::kProbe - 1) * pieces));
  while (rows < most && controller_.hasRoom(waiting() + (pieces + rows) * packet, now)) ++rows;
  return rows;
}

void FrameSender::add(std::shared_ptr<const datagram::FramePieces> frame, unsigned rows,
                      Clock::time_point now) {
  const unsigned pieces = frame->dataPieces() + rows;
  const std::uint32_t number = sent_.add(frame, pieces, schedule::microseconds(now));
  newest_ = {.frame = frame, .number = number, .index = 0};
  frameShare_ = static_cast<double>(frame->messageBytes()) / (pieces * packetBytes(*frame));
  const unsigned first = parity_.defers() ? frame->dataPieces() : pieces;
  queue({.frame = frame, .number = number, .index = 0}, first, now);
  queueDeferred(now);
  if (first < pieces)
    deferred_ = {.first = {.frame = std::move(frame), .number = number, .index = first},
                 .end = pieces,
                 .due = now + kLongestDelay};
}

void FrameSender::queue(Packet first, unsigned end, Clock::time_point now) {
  // A piece that the pacer has no room for counts as lost: the peer requests it.
  for (; first.index < end; ++first.index)
    if (!pacer_.add(first, packetBytes(*first.frame), false, now)) break;
}

void FrameSender::queueDeferred(Clock::time_point now) {
  if (const std::optional<Deferred> deferred = std::exchange(deferred_, std::nullopt))
    queue(deferred->first, deferred->end, now);
}

void FrameSender::probe(Clock::time_point now) {
  if (newest_) static_cast<void>(pacer_.add(*newest_, packetBytes(*newest_->frame), true, now));
}

std::size_t FrameSender::next(Clock::time_point now, std::span<std::byte> out) {
  if (deferred_ && now >= deferred_->due) queueDeferred(now);
  const std::optional<Packet> packet = pacer_.next(controller_.pace(), controller_.quantum(), now);
  if (!packet) return 0;
  const datagram::PiecePrefix prefix{.packet = nextPacket_++,
                                     .sentUs = static_cast<std::uint32_t>(schedule::microseconds(now)),
                                     .frame = packet->number};
  controller_.sent(prefix.packet, packetBytes(*packet->frame), now);
  return packet->frame->write(prefix, packet->index, out);
}

std::size_t FrameSender::answer(const datagram::PieceRequest& request, Clock::time_point now) {
  const auto repeat = sent_.answer(request, schedule::microseconds(now));
  if (!repeat) return 0;
  std::size_t queued = 0;
  for (unsigned index = 0; index < repeat->frame->pieces(); ++index)
    if (repeat->pieces[index] &&
        pacer_.add({repeat->frame, repeat->number, index}, packetBytes(*repeat->frame), true, now))
      ++queued;
  return queued;
}

std::optional<std::uint64_t> FrameSender::acknowledge(const datagram::Receipt& receipt,
                                                      Clock::time_point now) {
  const std::uint64_t lostBefore = controller_.lostPackets();
  if (!controller_.received(receipt.newest, receipt.arrivalUs, receipt.before, now)) return std::nullopt;
  parity_.update({.share = controller_.loss().share(), .burst = controller_.loss().burst()}, now);
  return controller_.lostPackets() - lostBefore;
}

delivery::LinkOutlet::Link FrameSender::link(Clock::time_point now) {
  return {.hasRoom = controller_.hasRoom(waiting(), now), .frameRate = controller_.rate() * frameShare_};
}

std::uint64_t FrameSender::waiting() const {
  if (!deferred_) return pacer_.bytes();
  return pacer_.bytes() + (deferred_->end - deferred_->first.index) * packetBytes(*deferred_->first.frame);
}

std::optional<Clock::time_point> FrameSender::due() const {
  const std::optional<Clock::time_point> due = pacer_.due();
  return due || !deferred_ ? due : deferred_->due;
}

void FrameSender::forgetPath() {
  deferred_.reset();
  controller_ = RateController();
  pacer_.clear();
}

}  // namespace clothstream::endpoint
