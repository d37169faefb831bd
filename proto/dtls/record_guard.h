// SPDX-License-Identifier: MIT
// Looks at records before OpenSSL does, because some of what anybody can forge costs it much.
#pragma once

#include <cstddef>
#include <span>

namespace clothstream::dtls {

// Returns whether the datagram consists of whole records (RFC 6347, section 4.1), and whether the encrypted
// ones have at least this many bytes: what their cipher adds to a payload. OpenSSL 3.0 ends an association
// that gets a shorter one, although its sender needs no key.
[[nodiscard]] bool hasWholeRecords(std::span<const std::byte> datagram, std::size_t leastEncrypted);

// Bounds the memory that a peer can make OpenSSL take before its handshake has proven its identity. OpenSSL
// makes room for a whole message when it sees its first fragment, for up to ten messages ahead, and keeps up
// to 100 encrypted records of 17 kB each that come before the keys. A handshake of an honest peer needs far
// less.
class HandshakeGuard {
 public:
  // Returns whether OpenSSL may have the datagram: its records are whole, and no message is longer than
  // kMaxHandshakeMessage or has a number beyond a handshake's (RFC 6347, section 4.2.2). Two encrypted
  // records are let through: the peer's Finished, which can arrive before what it needs, and its repetition.
  [[nodiscard]] bool admits(std::span<const std::byte> datagram);

  // Returns whether the peer has sent more bytes than any handshake needs. Its repetitions count, too.
  bool isExhausted() const { return bytes_ > kMaxBytes; }

 private:
  static constexpr std::size_t kMaxBytes = 48 * 1024;
  static constexpr int kMaxEncrypted = 2;

  std::size_t bytes_ = 0;
  int encrypted_ = 0;
};

}  // namespace clothstream::dtls
