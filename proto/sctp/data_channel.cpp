// SPDX-License-Identifier: MIT
#include "proto/sctp/data_channel.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <limits>
#include <utility>
#include <vector>

#include "proto/sctp/big_endian.h"

namespace clothstream::sctp {
namespace {

// Payload protocol identifiers (RFC 8831, section 8).
constexpr std::uint32_t kControl = 50, kBinary = 53;
// RFC 8832, section 5.
constexpr std::byte kAck{2}, kOpen{3};
constexpr std::byte kUnorderedWithFewRepeats{0x81};
constexpr std::size_t kOpenBytes = 12;  // before the label

}  // namespace

DataChannel::DataChannel(Options options, Bytes transmit, Bytes deliver)
    : label_(std::move(options.label)),
      deliver_(std::move(deliver)),
      association_(options.association,
                   {.transmit = std::move(transmit),
                    .deliver = [this](const Message& message) { this->deliver(message); },
                    .reset = [this](std::optional<std::uint16_t> stream) { reset(stream); }}) {
  assert(kOpenBytes + label_.size() <= kMaxPayloadBytes);
}

void DataChannel::connect(Time now) {
  assert(state_ == State::waiting);
  state_ = State::connecting;
  association_.connect(now);
}

void DataChannel::receive(Time now, std::span<const std::byte> packet) {
  now_ = now;
  association_.receive(now, packet);
  if (state_ == State::connecting && association_.isConnected()) sendOpen(now);
}

void DataChannel::advance(Time now) {
  association_.advance(now);
}

SendResult DataChannel::send(Time now, std::span<const std::byte> payload, bool sackNow) {
  if (!isOpen()) return SendResult::notConnected;
  return association_.send(now, {stream_, kBinary, payload}, sackNow);
}

std::string_view DataChannel::closeReason() const {
  if (association_.hasEnded()) return association_.endReason();
  return state_ == State::closed ? "the peer closed the channel" : "";
}

void DataChannel::deliver(const Message& message) {
  if (message.protocol == kControl) {
    readControl(message);
  } else if (message.protocol == kBinary && isOpen() && message.stream == stream_) {
    deliver_(message.payload);
  }
}

void DataChannel::readControl(const Message& message) {
  const std::byte type = message.payload[0];
  if (type == kAck) {
    if (state_ == State::opening && message.stream == stream_) state_ = State::open;
    return;
  }
  if (type != kOpen) return;
  if (state_ == State::waiting && isAcceptable(message.payload)) {
    const SendResult result = association_.sendReliable(now_, {message.stream, kControl, {&kAck, 1}});
    if (result != SendResult::sent) return;
    stream_ = message.stream;
    state_ = State::open;
  } else if (state_ != State::open || message.stream != stream_) {
    association_.resetStream(now_, message.stream);
  }
}

bool DataChannel::isAcceptable(std::span<const std::byte> open) const {
  if (open.size() < kOpenBytes) return false;
  const std::size_t label = read16(open, 8), protocol = read16(open, 10);
  if (open.size() != kOpenBytes + label + protocol) return false;
  constexpr std::uint32_t kRepeats = 0;
  return open[1] == kUnorderedWithFewRepeats && read32(open, 4) == kRepeats &&
         std::ranges::equal(open.subspan(kOpenBytes, label), std::as_bytes(std::span(label_)));
}

void DataChannel::sendOpen(Time now) {
  std::vector<std::byte> open(kOpenBytes + label_.size());
  open[0] = kOpen;
  open[1] = kUnorderedWithFewRepeats;
  write16(open, 8, label_.size());
  std::ranges::copy(std::as_bytes(std::span(label_)), open.begin() + kOpenBytes);
  if (association_.sendReliable(now, {stream_, kControl, open}) == SendResult::sent) state_ = State::opening;
}

// A channel is closed when both directions of its stream are reset (RFC 8831, section 6.7).
void DataChannel::reset(std::optional<std::uint16_t> stream) {
  if ((state_ != State::open && state_ != State::opening) || stream.value_or(stream_) != stream_) return;
  state_ = State::closed;
  association_.resetStream(now_, stream_);
}

}  // namespace clothstream::sctp
