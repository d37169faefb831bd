// SPDX-License-Identifier: MIT
// Datagrams of one client in addition to the stream of its messages (docs/transport.md), with a UDP socket.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "clients/core/core.h"
#include "clients/datagram/association.h"
#include "clients/datagram/udp_socket.h"
#include "proto/dtls/certificate.h"
#include "proto/dtls/dtls_context.h"
#include "proto/ice/connectivity_check.h"

namespace clothstream {

// Parts that many sessions share: a certificate, and the thread of their sockets. Throws std::runtime_error
// if OpenSSL fails.
struct DatagramHost {
  dtls::Certificate certificate;
  dtls::DtlsContext context{certificate};
  UdpThread thread;
  // Whether payloads travel in SCTP, as those of browsers must. That costs both ends time and bytes.
  bool sctp = false;
};

// Adds the counts.
void add(cs_datagram_statistics& sum, const cs_datagram_statistics& other);

// Offers datagrams on each connection of the stream, and again kOfferAgain after they have ended. If they
// fail, everything travels on the stream. Not thread-safe. Pinned: its association calls it.
class DatagramSession {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::seconds kOfferAgain{60};

  // `onArrival`: as for UdpSocket. exchange() must follow soon, on the thread of the session.
  DatagramSession(DatagramHost& host, std::function<void()> onArrival);
  ~DatagramSession() { close(); }
  DatagramSession(const DatagramSession&) = delete;
  DatagramSession& operator=(const DatagramSession&) = delete;

  // A connection of the stream begins, after cs_connecting, or ends.
  void connecting();
  void close();

  // Makes the offer, and takes the answer. Call it before the client's messages are sent. `streamAddress` is
  // as Transport::serverAddress(): this address is tried first, because the server may not know it.
  void negotiate(cs_client& client, const std::function<std::string()>& streamAddress);
  // Receives and sends datagrams. Call it at dueTime(), after arrivals, and after the functions below.
  void exchange();
  Time dueTime() const;

  // The functions of cs_datagrams in core.h with the present time. While there are no datagrams, they return
  // false and nothing. The bytes are valid until the next call of any function.
  bool holds(std::span<const std::byte> message);
  bool sends(std::span<const std::byte> message);
  std::optional<std::span<const std::byte>> nextMessage();
  std::optional<std::span<const std::byte>> nextStreamMessage();

  // Whether datagrams were open at any time.
  bool hasOpened() const { return hasOpened_; }
  // Whether the server has answered the newest offer that it opens none.
  bool isRefused() const { return refused_; }
  // Why they are not open, as a part of a sentence.
  std::string why() const { return association_ ? association_->why() : why_; }
  // Sum over all connections.
  cs_datagram_statistics statistics() const;

 private:
  void offer(cs_client& client);
  void begin(const DatagramPeer& peer);
  // Ends the datagrams. `why` is a part of a sentence.
  void end(std::string why);

  DatagramHost& host_;
  const std::function<void()> onArrival_;
  std::unique_ptr<UdpSocket> socket_;  // from the first answer with addresses on
  ice::Credentials local_;             // of the newest offer
  Time offerAt_ = Time::max();         // Time::max() while an offer is not answered, or was accepted
  bool awaitsAnswer_ = false, refused_ = false;
  // Both exist from an answer with addresses until the datagrams end.
  std::unique_ptr<cs_datagrams, decltype(&cs_destroy_datagrams)> link_{nullptr, &cs_destroy_datagrams};
  std::optional<Association> association_;
  bool hasOpened_ = false;
  std::string why_ = "the server has not answered the offer";
  cs_datagram_statistics earlier_{};  // of the links before this one
};

}  // namespace clothstream
