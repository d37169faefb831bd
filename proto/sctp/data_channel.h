// SPDX-License-Identifier: MIT
// One WebRTC data channel over an association (RFC 8831, RFC 8832).
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "proto/sctp/association.h"

namespace clothstream::sctp {

// An unordered channel whose messages are never repeated, for binary messages of up to kMaxPayloadBytes. A
// browser makes it with `createDataChannel(label, {ordered: false, maxRetransmits: 0})`.
//
// The accepting side takes the first channel of the peer with this label, type and no lifetime. It refuses
// any other one by a reset of its stream, which closes it at the browser. Messages of other channels, text
// and empty messages are dropped. A channel that was closed is not opened again. Not thread-safe; see
// Association for times.
class DataChannel {
 public:
  struct Options {
    std::string label;
    Association::Options association;
  };
  // `transmit` gets each packet, for one DTLS record. `deliver` gets the messages of the peer. See
  // Association::Callbacks.
  using Bytes = std::function<void(std::span<const std::byte> bytes)>;
  DataChannel(Options options, Bytes transmit, Bytes deliver);
  DataChannel(const DataChannel&) = delete;
  DataChannel& operator=(const DataChannel&) = delete;

  // Opens the channel from this side, which must be the DTLS client: it uses stream 0 (RFC 8832, section 6).
  // Without this call the channel waits for the peer. Call it at most once, before the first packet is
  // received.
  void connect(Time now);
  void receive(Time now, std::span<const std::byte> packet);
  void advance(Time now);
  Time deadline() const { return association_.deadline(); }

  // Sends a message, which is lost if its packet is. `sackNow` asks the peer to acknowledge without delay.
  [[nodiscard]] SendResult send(Time now, std::span<const std::byte> payload, bool sackNow);
  // Ends the association with an ABORT. `reason` must be a constant.
  void close(std::string_view reason) { association_.abort(reason); }

  bool isOpen() const { return state_ == State::open && association_.isConnected(); }
  bool isClosed() const { return state_ == State::closed || association_.hasEnded(); }
  // Why the channel is closed, for logs; empty before.
  std::string_view closeReason() const;

 private:
  enum class State { waiting, connecting, opening, open, closed };

  void deliver(const Message& message);
  void readControl(const Message& message);
  bool isAcceptable(std::span<const std::byte> open) const;
  void sendOpen(Time now);
  void reset(std::optional<std::uint16_t> stream);

  const std::string label_;
  const Bytes deliver_;
  State state_ = State::waiting;
  std::uint16_t stream_ = 0;
  Time now_{};  // of the packet that is handled
  Association association_;
};

}  // namespace clothstream::sctp
