// SPDX-License-Identifier: MIT
// STUN messages of ICE (RFC 8489, RFC 8445): binding requests and responses.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "proto/ice/address.h"

namespace clothstream::ice {

// Longest message that is read: what fits into the smallest IPv4 datagram that every host accepts (RFC 8489,
// section 6.1). Checks have 80 to 200 bytes.
inline constexpr std::size_t kMaxStunBytes = 548;
// Longest user name that is written, bytes.
inline constexpr std::size_t kMaxUsername = 256;

// Method and class (RFC 8489, section 5). Binding is the only method.
enum class StunKind : std::uint16_t {
  request = 0x0001,
  indication = 0x0011,
  success = 0x0101,
  error = 0x0111
};

// Role of an agent (RFC 8445, section 6.1.1).
enum class Role : std::uint8_t { controlled, controlling };

// Codes of errors (RFC 8489, section 14.8; RFC 8445, section 7.3.1.1).
inline constexpr std::uint16_t kBadRequest = 400, kUnknownAttribute = 420, kRoleConflict = 487;

using TransactionId = std::array<std::byte, 12>;

// A message with what ICE uses of its attributes.
struct StunMessage {
  StunKind kind{};
  TransactionId transaction{};
  std::string_view username{};              // empty: no USERNAME. A view into the datagram that was read.
  std::optional<std::uint32_t> priority{};  // PRIORITY
  std::optional<Role> role{};               // ICE-CONTROLLED or ICE-CONTROLLING
  std::uint64_t tieBreaker = 0;             // value of the role's attribute
  bool useCandidate = false;                // USE-CANDIDATE
  std::optional<Address> mapped{};          // XOR-MAPPED-ADDRESS
  std::uint16_t error = 0;                  // ERROR-CODE, 300 to 699; 0: no such attribute
  // Types of attributes that a receiver must understand and this one does not. At most kMaxUnknown.
  std::vector<std::uint16_t> unknown{};
  // Offset of MESSAGE-INTEGRITY in the datagram that was read; 0: the message has none.
  std::size_t integrityAt = 0;

  static constexpr std::size_t kMaxUnknown = 8;
};

// Returns whether the first byte of a datagram is that of a STUN message. Records of DTLS begin differently
// (RFC 7983).
inline bool isStun(std::span<const std::byte> datagram) {
  return !datagram.empty() && datagram[0] <= std::byte{3};
}

// Reads a datagram of any bytes. Nothing if it is not one whole binding message with a valid FINGERPRINT,
// which ICE requires (RFC 8445, section 7.1), or if an attribute has a wrong length. MESSAGE-INTEGRITY is not
// checked. Of repeated attributes the first counts; those after MESSAGE-INTEGRITY do not count.
[[nodiscard]] std::optional<StunMessage> readStun(std::span<const std::byte> datagram);

// Returns whether the datagram from which the message was read has a MESSAGE-INTEGRITY of this short-term
// password (RFC 8489, sections 9.1 and 14.5). Constant-time comparison.
[[nodiscard]] bool hasIntegrity(const StunMessage& message, std::span<const std::byte> datagram,
                                std::string_view password);

// Bytes of a message with MESSAGE-INTEGRITY of the password and FINGERPRINT. `integrityAt` is ignored, and
// ERROR-CODE has no reason phrase. The user name has at most kMaxUsername bytes.
std::vector<std::byte> writeStun(const StunMessage& message, std::string_view password);

}  // namespace clothstream::ice
