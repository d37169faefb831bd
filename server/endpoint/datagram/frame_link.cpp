// SPDX-License-Identifier: MIT
#include "server/endpoint/datagram/frame_link.h"

#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "proto/datagram/datagram.h"
#include "proto/datagram/piece_request.h"
#include "proto/datagram/receipt.h"

namespace clothstream::endpoint {
namespace {

// The room of the link changes for this long after the newest frame, because packets without a receipt are
// given up.
constexpr Clock::duration kSettled = 2 * delivery::RateController::kSilence;

}  // namespace

FrameLink::FrameLink(hosting::DatagramPeer peer, std::function<void()> wake, std::uint32_t headerBytes,
                     SharedPieces& pieces, telemetry::DatagramMetrics& metrics)
    : peer_(std::move(peer)), pieces_(pieces), metrics_(metrics), sender_(headerBytes) {
  peer_.outlet->setFrameWake(std::move(wake));
}

FrameLink::~FrameLink() {
  enter(State::closed, {});
  peer_.outlet->setFrameWake(nullptr);
}

void FrameLink::enter(State state, Clock::time_point now) {
  if (state == state_) return;
  if (state == State::used) ++metrics_.peers;
  if (state_ == State::used) {
    --metrics_.peers;
    peer_.outlet->setLink(std::nullopt);
    sender_.forgetPath();
  }
  state_ = state;
  since_ = now;
  if (state == State::used) updateLink(now);
}

void FrameLink::receive(std::span<const std::byte> payload, Clock::time_point now) {
  if (const auto messages = input_.receive(payload)) {
    for (const std::span<const std::byte> message : *messages) peer_.receive(message);
  } else if (const auto receipt = datagram::parseReceipt(payload)) {
    const std::optional<std::uint64_t> lost = sender_.acknowledge(*receipt, now);
    metrics_.lost.add(lost.value_or(0));
    if (state_ == State::used && lost) updateLink(now);
  } else if (const auto request = datagram::parseRequest(payload)) {
    metrics_.repeats.add(sender_.answer(*request, now));
  }
}

void FrameLink::advance(bool open, Clock::time_point now, const Send& send) {
  if (!open) return enter(State::closed, now);
  if (state_ == State::closed) {
    enter(State::used, now);
  } else if (state_ == State::used && sender_.silent(now)) {
    metrics_.fallbacks.add();
    if (now - since_ >= kLongestPause) pause_ = kFirstPause;
    probeAt_ = now + pause_;
    enter(State::silent, now);
  } else if (state_ == State::silent && sender_.isHeard()) {
    enter(State::used, now);
  } else if (state_ == State::silent && now >= probeAt_) {
    sender_.probe(now);
    pause_ = std::min<Clock::duration>(2 * pause_, kLongestPause);
    probeAt_ = now + pause_;
  }
  if (state_ == State::used) {
    if (now - updated_ >= kUpdateInterval) updateLink(now);
    takeFrames(now);
  }
  std::array<std::byte, datagram::kMaxDatagramBytes> payload;
  while (const std::size_t size = sender_.next(now, payload)) {
    metrics_.packets.add();
    metrics_.bytes.add(size);
    send(std::span(payload).first(size), !sender_.due());
  }
}

void FrameLink::peerMoved(Clock::time_point now) {
  sender_.forgetPath();
  if (state_ == State::used) updateLink(now);
  probeAt_ = std::min(probeAt_, now);
  pause_ = kFirstPause;
}

void FrameLink::takeFrames(Clock::time_point now) {
  delivery::LinkOutlet& outlet = *peer_.outlet;
  while (const std::optional<delivery::SharedBytes> frame = outlet.nextFrame(now)) {
    const unsigned rows = sender_.rowsFor((*frame)->size(), outlet.wantsFinerQuality(), now);
    sender_.add(pieces_.of(*frame, rows), rows, now);
    sent_ = now;
    updateLink(now);
  }
}

void FrameLink::updateLink(Clock::time_point now) {
  updated_ = now;
  peer_.outlet->setLink(sender_.link(now));
}

Clock::time_point FrameLink::nextTime() const {
  if (state_ == State::closed) return Clock::time_point::max();
  Clock::time_point next = sender_.due().value_or(Clock::time_point::max());
  if (state_ == State::used && updated_ - sent_ < kSettled) next = std::min(next, updated_ + kUpdateInterval);
  if (state_ == State::silent) next = std::min(next, probeAt_);
  return next;
}

}  // namespace clothstream::endpoint
