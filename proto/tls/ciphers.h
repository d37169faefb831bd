// SPDX-License-Identifier: MIT
// Policy for ciphers of every encrypted connection of the server.
#pragma once

namespace clothstream::tls {

// Ciphers of TLS 1.2 and DTLS 1.2 with forward secrecy and authenticated encryption. TLS 1.3 has no others.
inline constexpr const char* kCiphers = "ECDHE+AESGCM:ECDHE+CHACHA20";

}  // namespace clothstream::tls
