// SPDX-License-Identifier: MIT
// One DTLS 1.2 association: datagrams in, datagrams out.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

#include "proto/dtls/dtls_context.h"
#include "proto/dtls/limits.h"
#include "proto/dtls/record_guard.h"

namespace clothstream::dtls {

using Time = std::chrono::steady_clock::time_point;

// A client begins the handshake; a server waits for it.
enum class Role : std::uint8_t { client, server };

struct DtlsStatistics {
  std::uint64_t datagramsSent = 0, bytesSent = 0;  // of UDP payload, with those of the handshake
  std::uint64_t datagramsReceived = 0, bytesReceived = 0;
  std::uint64_t payloads = 0;  // payloads received
  std::uint64_t dropped = 0;   // datagrams that OpenSSL did not get (record_guard.h), or that are too long
  std::uint64_t repeatedFlights = 0;  // of the handshake, after a time-out
  Time::duration handshake{};         // time from the start to the end of the handshake
};

// The handshake fails unless the peer has the certificate of the fingerprint from signalling. Payloads can be
// lost and reordered, as datagrams are; repeated ones are dropped. Pinned, because OpenSSL keeps its address.
// Not thread-safe; associations of one context can be in different threads. It reads no clock, but OpenSSL
// measures the timer of the handshake with gettimeofday().
class DtlsChannel {
 public:
  enum class State : std::uint8_t { handshake, open, closed, failed };

  // Both are called during the channel's functions. They must not destroy it, and throw nothing.
  struct Callbacks {
    // Sends a datagram to the peer, or loses it. Must not call the channel.
    std::function<void(std::span<const std::byte> datagram)> send;
    // Takes a payload. May call send() and close().
    std::function<void(std::span<const std::byte> payload)> receive;
  };

  // `peerFingerprint`: in the form of readFingerprint(). A client sends its first datagram at once. Throws
  // std::runtime_error if OpenSSL fails.
  DtlsChannel(const DtlsContext& context, Role role, std::string peerFingerprint, Callbacks callbacks,
              Time now);
  DtlsChannel(const DtlsChannel&) = delete;
  DtlsChannel& operator=(const DtlsChannel&) = delete;

  // Handles a datagram of any bytes from the peer's address. Damaged, repeated and foreign records are
  // dropped without effect, as RFC 6347, section 4.1.2.7, requires.
  void handle(std::span<const std::byte> datagram, Time now);

  // Sends a payload of 1 to kMaxPayloadBytes bytes in a record and datagram. Returns false, and sends
  // nothing, if the channel is not open or the size is wrong.
  bool send(std::span<const std::byte> payload);

  // Repeats the flight of the handshake that is not answered, after 100 ms, 200 ms, 400 ms and then every
  // 800 ms. The channel fails kHandshakeLimit after its start. Call it at nextTime().
  void advance(Time now);
  // Time::max() without a handshake.
  Time nextTime() const;

  // Ends the association, and says so to the peer (close_notify).
  void close();

  State state() const { return state_; }
  // Why the channel has failed, as a sentence for a log. Text of the peer is not part of it.
  const std::string& error() const { return error_; }
  const DtlsStatistics& statistics() const { return statistics_; }

  static constexpr std::chrono::seconds kHandshakeLimit{8};

 private:
  struct Bridge;  // BIO between OpenSSL and the channel

  bool admits(std::span<const std::byte> datagram);
  void read(Time now);
  void readTimer(Time now);
  // Takes the reason of a failed call from SSL_get_error(), which must be asked first.
  void end(int reason);
  void fail(std::string error);

  const std::string peerFingerprint_;
  const Callbacks callbacks_;
  const Time begun_;
  const std::unique_ptr<SSL, tls::Freed<SSL_free>> ssl_;
  std::span<const std::byte> incoming_;  // the datagram that OpenSSL reads next
  HandshakeGuard guard_;
  std::size_t leastEncrypted_ = 0;  // size of an encrypted record without payload, when it is open
  State state_ = State::handshake;
  Time timer_ = Time::max();  // when OpenSSL's timer of the handshake ends
  std::string error_;
  DtlsStatistics statistics_;
};

}  // namespace clothstream::dtls
