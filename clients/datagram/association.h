// SPDX-License-Identifier: MIT
// Encrypted datagrams with a server: ICE finds its address, DTLS encrypts, and SCTP carries payloads if they
// are to travel as those of a browser. Without sockets.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/dtls/dtls_channel.h"
#include "proto/dtls/dtls_context.h"
#include "proto/ice/checking_agent.h"
#include "proto/sctp/data_channel.h"

namespace clothstream {

// Answer of the server to an offer.
struct DatagramPeer {
  ice::Credentials credentials;         // valid (ice::isValid)
  std::string fingerprint;              // in the form of dtls::readFingerprint()
  std::vector<ice::Address> addresses;  // the preferred one first
  bool sctp = false;                    // as in the offer
};

// Pinned: the channel calls it. Not thread-safe. Reads no clock, but see dtls::DtlsChannel.
class Association {
 public:
  using Time = std::chrono::steady_clock::time_point;

  // Called during the functions of the association; must not call it, and throw nothing.
  struct Callbacks {
    std::function<void(const ice::Address& to, std::span<const std::byte> datagram)> send;
    std::function<void(std::span<const std::byte> payload)> receive;
  };

  // `local`: credentials of the offer. The context has the certificate of the offer, and must outlive it.
  Association(const dtls::DtlsContext& context, ice::Credentials local, const DatagramPeer& peer,
              Callbacks callbacks, Time now);
  Association(const Association&) = delete;
  Association& operator=(const Association&) = delete;

  // Handles a UDP datagram of any bytes.
  void handle(const ice::Address& from, std::span<const std::byte> datagram, Time now);
  // Sends what is due. Call it at nextTime(), and once at first.
  void advance(Time now);
  Time nextTime() const;

  // Sends a payload, or loses it.
  void send(std::span<const std::byte> payload, Time now);
  // Ends the association, and says so to the server.
  void close(Time now);

  // Whether the handshake is complete. Stays true when the association ends.
  bool hasOpened() const { return hasOpened_; }
  // Whether it has ended, or never can open.
  bool isOver(Time now) const;
  // Why it has ended or not opened, as a part of a sentence.
  std::string why() const;
  // Round-trip time of the last answered check.
  std::optional<Time::duration> roundTrip() const { return agent_.roundTrip(); }

 private:
  void send(const std::vector<ice::Datagram>& datagrams) const;
  // Begins the handshakes, each when the one below is complete.
  void begin(Time now);
  bool isOpen() const;

  const dtls::DtlsContext& context_;
  const std::string peerFingerprint_;
  const bool sctp_;
  const Callbacks callbacks_;
  Time now_;  // of the function that runs
  ice::CheckingAgent agent_;
  // Address to which the channel sends now; nothing while none answers.
  std::optional<ice::Address> path_;
  std::optional<dtls::DtlsChannel> channel_;
  std::optional<sctp::DataChannel> data_;  // over an open channel
  bool hasOpened_ = false;
};

}  // namespace clothstream
