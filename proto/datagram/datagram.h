// SPDX-License-Identifier: MIT
// Kinds and largest size of the datagrams between server and client. docs/datagrams.md defines the bytes.
#pragma once

#include <bitset>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "proto/datagram/erasure_code.h"

namespace clothstream::datagram {

// First byte of every datagram.
enum class Kind : std::uint8_t {
  piece = 1,    // down: piece of a frame
  input = 2,    // up: numbered ClientMessages
  request = 3,  // up: pieces that are missing
  receipt = 4,  // up: packets that arrived
};

// Bytes of the largest datagram: payload of a DTLS record or SCTP message. It then fits into the 1,280 bytes
// that every IPv6 path carries (RFC 8200 section 5), with all headers.
inline constexpr std::size_t kMaxDatagramBytes = 1150;

// Set of pieces of a frame, by index: data pieces first, then parity pieces.
using PieceSet = std::bitset<kMaxDataPieces + kMaxParityPieces>;

// nullopt if the datagram is empty, too long, or of another kind.
[[nodiscard]] inline std::optional<Kind> kindOf(std::span<const std::byte> datagram) {
  if (datagram.empty() || datagram.size() > kMaxDatagramBytes) return std::nullopt;
  const auto kind = static_cast<Kind>(datagram.front());
  if (kind < Kind::piece || kind > Kind::receipt) return std::nullopt;
  return kind;
}

// Steps from one number to another, forwards or backwards, where numbers continue with 0 after 2^32 - 1
// (serial number arithmetic, RFC 1982 section 3.2). At 2^31 steps the direction is undefined.
inline std::int32_t steps(std::uint32_t from, std::uint32_t to) {
  return static_cast<std::int32_t>(to - from);
}

}  // namespace clothstream::datagram
