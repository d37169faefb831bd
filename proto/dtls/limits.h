// SPDX-License-Identifier: MIT
// Sizes of what DTLS sends and accepts.
#pragma once

#include <cstddef>

namespace clothstream::dtls {

// Longest datagram of a handshake that is sent, bytes of UDP payload.
inline constexpr std::size_t kHandshakeMtu = 1200;
// Longest message of a handshake that is accepted, bytes. The longest that browsers send are a ClientHello of
// 0.3 to 2 kB and a certificate of 0.3 to 1.5 kB.
inline constexpr std::size_t kMaxHandshakeMessage = 4096;
// Longest payload of a record that is sent. Its datagram then has up to 1,232 bytes, which every path of IPv6
// carries (RFC 8200, section 5: 1,280 bytes less the headers of IPv6 and UDP).
inline constexpr std::size_t kMaxPayloadBytes = 1195;
// Longest datagram that is accepted.
inline constexpr std::size_t kMaxDatagramBytes = 2048;

}  // namespace clothstream::dtls
