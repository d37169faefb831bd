// SPDX-License-Identifier: MIT
// Server's side of ICE for one peer: a lite agent (RFC 8445, section 2.5), which is always controlled.
#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "proto/ice/connectivity_check.h"

namespace clothstream::ice {

// Answers the checks of a peer, and says to which address datagrams may be sent. A check alone does not
// select an address, because its sender can forge the source. The agent sends a check to the address, and
// selects it when the answer proves that the peer receives there. So an address that is not proven receives
// at most three times the bytes that came from it, as with QUIC (RFC 9000, section 8.1): per check the answer
// and two checks, none of them longer than the peer's. Not thread-safe. Reads no clock.
class LiteAgent {
 public:
  // Both credentials are valid (isValid).
  LiteAgent(Credentials local, Credentials remote, Time now)
      : pairing_(std::move(local), std::move(remote), Role::controlled), lastCheck_(now) {}

  // Handles a STUN message (isStun) of any bytes from this address, and returns what must be sent. Messages
  // without MESSAGE-INTEGRITY of the password have no effect and no answer.
  [[nodiscard]] std::vector<Datagram> handle(const Address& from, std::span<const std::byte> datagram,
                                             Time now);

  // Repeats a check to an address that has not answered. Call it at nextTime().
  [[nodiscard]] std::vector<Datagram> advance(Time now);
  // Time::max() if no check waits to be repeated.
  Time nextTime() const { return proof_ && !proof_->repeated ? proof_->sentAt + kRepeatAfter : Time::max(); }

  // Address to which sending is allowed: the proven one while its last valid check is less than kConsent old.
  // A later check of the peer from there allows sending again. Nothing before the first proof.
  std::optional<Address> selected(Time now) const {
    return now - lastCheck_ < kConsent ? selected_ : std::nullopt;
  }

  // Returns whether kEndsAfter has passed since the start or the last valid check from the selected address.
  // The agent then has no effects any more.
  bool isOver(Time now) const { return now - lastCheck_ >= kEndsAfter; }

 private:
  static constexpr std::chrono::milliseconds kRepeatAfter{100};
  // A proof that is not answered makes way for another address after kTurn, or when the peer nominates it,
  // and is forgotten after kProofTime.
  static constexpr std::chrono::milliseconds kTurn{500}, kProofTime{5'000};

  // An address whose answer is awaited.
  struct Proof {
    Address address;
    TransactionId transaction;
    Time begun, sentAt;
    bool repeated;
  };

  void checked(const Address& from, bool nominates, Time now, std::vector<Datagram>& out);

  const Pairing pairing_;
  std::optional<Address> selected_;
  std::optional<Proof> proof_;
  Time lastCheck_;  // from the selected address; before the first one, the start
};

}  // namespace clothstream::ice
