// SPDX-License-Identifier: MIT
// Datagrams with one peer: its path, and what travels on it.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "server/endpoint/datagram/frame_link.h"
#include "server/endpoint/datagram/secure_path.h"
#include "server/schedule/token_bucket.h"

namespace clothstream::endpoint {

// Parts that all associations of an endpoint use. They must outlive the associations.
struct AssociationContext {
  const dtls::DtlsContext& dtls;
  SharedPieces& pieces;
  telemetry::DatagramMetrics& metrics;
};

// Not thread-safe. Reads no clock.
class Association {
 public:
  // Datagrams from the peer's proven address in a second, and in a burst. Further ones are dropped.
  static constexpr double kDatagramsPerSecond = 2000, kBurst = 500;
  // The same of all other addresses together: anybody who has seen a check can send others with its name.
  static constexpr double kUnprovenPerSecond = 100, kUnprovenBurst = 100;

  // `local`: the server's credentials. `wake` is called, from any thread, when the peer's outlet has
  // something. For the other functions see SecurePath::Callbacks.
  using Transmit = std::function<void(const Address& to, std::span<const std::byte> datagram)>;
  using Admit = std::function<std::shared_ptr<const void>(const Address& from)>;
  Association(const AssociationContext& context, ice::Credentials local, hosting::DatagramPeer peer,
              std::function<void()> wake, Transmit transmit, Admit admit, Time now);

  enum class Handled : std::uint8_t {
    dropped,  // there were too many; nothing has changed
    check,    // an authentic one of the peer
    other,
  };
  // Handles a datagram of any bytes.
  Handled handle(const Address& from, std::span<const std::byte> datagram, Time now);
  // Does what is due. Call it at nextTime(), after handle(), and when the peer's outlet has something.
  void advance(Time now);
  Time nextTime() const;

  const std::string& ufrag() const { return ufrag_; }
  std::optional<Address> selected(Time now) const { return path_.selected(now); }
  bool isOver(Time now) const { return path_.isOver(now); }

 private:
  const std::string ufrag_;  // of the server
  schedule::TokenBucket rate_{kDatagramsPerSecond, kBurst};
  schedule::TokenBucket unprovenRate_{kUnprovenPerSecond, kUnprovenBurst};
  Time now_;  // of the function that runs
  Time checkAt_{};
  bool wasOpen_ = false;
  std::optional<Address> address_;  // newest one to which sending was allowed
  FrameLink link_;
  SecurePath path_;  // ends before the link, because it may deliver
};

}  // namespace clothstream::endpoint
