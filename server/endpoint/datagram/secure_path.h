// SPDX-License-Identifier: MIT
// Encrypted path to one peer: ICE, DTLS and, for a browser, SCTP.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "proto/dtls/dtls_channel.h"
#include "proto/ice/lite_agent.h"
#include "proto/sctp/data_channel.h"
#include "server/messages/datagram_offer.h"

namespace clothstream::endpoint {

using ice::Address;
using Time = std::chrono::steady_clock::time_point;

// The server's end, which waits for the peer. Payloads are those of the peer's data channel, or of DTLS
// records. A path whose handshake fails, or that the peer closes, is over: the peer must offer a new one.
//
// Not thread-safe. Reads no clock.
class SecurePath {
 public:
  // All are called during functions of the path, and must neither call nor destroy it. The first two throw
  // nothing.
  struct Callbacks {
    std::function<void(const Address& to, std::span<const std::byte> datagram)> transmit;
    std::function<void(std::span<const std::byte> payload)> deliver;
    // Permits a handshake with this address, which counts while the result lives. Null: there are too many.
    std::function<std::shared_ptr<const void>(const Address& from)> admit;
  };

  // `local` are valid credentials. `context` must outlive the path.
  SecurePath(const dtls::DtlsContext& context, ice::Credentials local, const messages::DatagramOffer& offer,
             Callbacks callbacks, Time now);
  ~SecurePath();
  SecurePath(const SecurePath&) = delete;
  SecurePath& operator=(const SecurePath&) = delete;

  // Bytes of each packet in addition to the payload, those of IPv6 and UDP included.
  static std::uint32_t headerBytes(bool sctp);

  // Handles a STUN message of any bytes. Returns whether it is an authentic check of the peer.
  bool handleCheck(const Address& from, std::span<const std::byte> datagram, Time now);
  // Handles another datagram of any bytes. Records from an address that is not proven yet wait for the proof,
  // the newest kMaxEarly of them.
  void handleRecord(const Address& from, std::span<const std::byte> datagram, Time now);
  // Does what is due. Call it at nextTime().
  void advance(Time now);
  Time nextTime() const;

  // Sends a payload of 1 to datagram::kMaxDatagramBytes bytes, or loses it if the path is not open.
  // `last`: no other one follows at once.
  void send(std::span<const std::byte> payload, bool last, Time now);

  // Address to which sending is allowed (ice::LiteAgent).
  std::optional<Address> selected(Time now) const { return agent_.selected(now); }
  // Whether payloads can be sent.
  bool isOpen() const;
  bool isOver(Time now) const;
  // Why the path is over, for logs.
  std::string endReason() const;

 private:
  static constexpr std::size_t kMaxEarly = 2;

  void transmit(std::vector<ice::Datagram> datagrams) const;
  // Opens the DTLS channel, if it may. Returns false if there is none.
  bool begin(const Address& from, Time now);
  void receive(std::span<const std::byte> payload);

  const dtls::DtlsContext& context_;
  const std::string peerFingerprint_;
  const bool sctp_;
  const Callbacks callbacks_;
  Time now_;  // of the function that runs
  ice::LiteAgent agent_;
  std::optional<std::pair<Address, std::vector<std::vector<std::byte>>>> early_;
  std::shared_ptr<const void> handshake_;  // permits it
  std::unique_ptr<dtls::DtlsChannel> dtls_;
  std::unique_ptr<sctp::DataChannel> channel_;
};

}  // namespace clothstream::endpoint
