// SPDX-License-Identifier: MIT
// Native client's side of ICE: a full agent that controls a lite one (RFC 8445), with one socket.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "proto/ice/connectivity_check.h"

namespace clothstream::ice {

// Finds an address of the server that answers, and keeps the server's consent to send. Checks go to one
// candidate after the other every kPace until one answers. That one is selected and nominated; then a check
// follows about every kConsentInterval, and every kRepeatAfter while it is not answered. When the server has
// sent something and then nothing for kSilence, a check follows, and another one every kSilence until one is
// answered: if the client's own address has changed, such as that of a phone that leaves its Wi-Fi, the
// server learns the new one by it. Without an answer for kConsent the search begins again. Not thread-safe.
// Reads no clock.
class CheckingAgent {
 public:
  // Both credentials are valid (isValid). `candidates`: the addresses of the server from signalling, the
  // preferred ones first. The first kMaxCandidates of them are checked, IPv6 and IPv4 alternately (RFC 8305,
  // section 4). Without any, the search finds nothing.
  CheckingAgent(Credentials local, Credentials remote, std::span<const Address> candidates, Time now);

  static constexpr std::size_t kMaxCandidates = 8;
  static constexpr std::chrono::milliseconds kPace{50};                // RFC 8445, section 14.2
  static constexpr std::chrono::milliseconds kConsentInterval{2'500};  // times 0.8 to 1.2; RFC 7675: 5 s
  static constexpr std::chrono::milliseconds kRepeatAfter{500};
  static constexpr std::chrono::milliseconds kSilence{100};  // a few frames

  // Sends the check that is due, if any. Call it at nextTime(), and at once after the constructor.
  [[nodiscard]] std::vector<Datagram> advance(Time now);
  Time nextTime() const { return std::min(nextCheck_, silentAt_); }
  // The selected address has sent something that is no STUN message.
  void arrived(Time now) {
    if (selected_) silentAt_ = now + kSilence;
  }

  // Handles a STUN message (isStun) of any bytes from this address, and returns what must be sent. The
  // server's own checks are answered, from wherever they come: they prove that they know our password.
  [[nodiscard]] std::vector<Datagram> handle(const Address& from, std::span<const std::byte> datagram,
                                             Time now);

  // The server's address to which sending is allowed. Nothing until one has answered, and when it has not
  // answered for kConsent: the path is lost.
  std::optional<Address> selected(Time now) const {
    return now - lastAnswer_ < kConsent ? selected_ : std::nullopt;
  }
  // Round-trip time of the last answered check.
  std::optional<Time::duration> roundTrip() const { return roundTrip_; }

  // Returns whether kEndsAfter has passed since the start or the last answer. No more checks are sent then.
  bool isOver(Time now) const { return now - lastAnswer_ >= kEndsAfter; }

 private:
  struct SentCheck {
    TransactionId transaction;
    Address to;
    Time at;
  };
  // Checks whose answers are accepted: with kPace, those of the last 3.2 s.
  static constexpr std::size_t kMaxSent = 64;

  const Pairing pairing_;
  const std::vector<Address> candidates_;
  std::size_t nextCandidate_ = 0;
  std::vector<SentCheck> sent_;  // oldest first
  std::optional<Address> selected_;
  std::optional<Time::duration> roundTrip_;
  Time lastAnswer_, nextCheck_;
  Time silentAt_ = Time::max();  // when silence of the server asks for a check
  Time::duration repeatAfter_ = kRepeatAfter;
};

}  // namespace clothstream::ice
