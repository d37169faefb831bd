// SPDX-License-Identifier: MIT
// Connectivity checks of ICE (RFC 8445, section 7) and their answers, for both kinds of agents.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "proto/ice/address.h"
#include "proto/ice/stun_message.h"

namespace clothstream::ice {

using Time = std::chrono::steady_clock::time_point;

// Sending to an address is allowed for this time after a check has shown that the peer wants it (RFC 7675,
// section 5.1, allows up to 30 s), and a session ends after kEndsAfter without one.
inline constexpr std::chrono::seconds kConsent{5}, kEndsAfter{30};

// User name fragment and password of one agent, from signalling (RFC 8839, section 5.4).
struct Credentials {
  std::string ufrag, password;
};

// Returns whether both have only letters, digits, + and /, the fragment 4 to 64 of them and the password 22
// to 256. RFC 8839 allows fragments of up to 256; agents use 4 to 8.
[[nodiscard]] bool isValid(const Credentials& credentials);

// Fragment of 48 random bits, password of 144. Throws std::runtime_error if OpenSSL has no random numbers.
Credentials randomCredentials();

// A random transaction. Throws as randomCredentials() does.
TransactionId newTransaction();

struct Datagram {
  Address to;
  std::vector<std::byte> bytes;
};

// Knowledge of one agent about itself and the other one, from signalling.
class Pairing {
 public:
  // Both credentials are valid (isValid). Throws as randomCredentials() does.
  Pairing(Credentials local, Credentials remote, Role role);

  // A check with this transaction. `nominate`: with USE-CANDIDATE, which only a controlling agent sends.
  std::vector<std::byte> check(const TransactionId& transaction, bool nominate) const;

  // Result of a request.
  struct Answer {
    bool accepted = false;   // the request is a valid check
    bool nominates = false;  // it has USE-CANDIDATE
    // The response. It is never longer than the request.
    std::vector<std::byte> bytes;
  };
  // Answers a request. Nothing for one that does not prove that its sender knows our password. RFC 8489
  // answers those with errors, too, but then anybody could use an agent to send datagrams to others.
  // Authentic requests that are not valid checks get the errors 400, 420 or 487.
  [[nodiscard]] std::optional<Answer> answer(const StunMessage& request, std::span<const std::byte> datagram,
                                             const Address& from) const;

  // Returns whether this is a success response whose sender knows the peer's password.
  [[nodiscard]] bool isAuthenticResponse(const StunMessage& response,
                                         std::span<const std::byte> datagram) const;

 private:
  const Credentials local_, remote_;
  const Role role_;
  const std::string sentUsername_, receivedUsername_;
  const std::uint64_t tieBreaker_;
};

}  // namespace clothstream::ice
