// SPDX-License-Identifier: MIT
// Certificate and policy for handshakes, which many DTLS associations share.
#pragma once

#include <memory>
#include <string>

#include <openssl/ssl.h>

#include "proto/dtls/certificate.h"
#include "proto/tls/openssl.h"

namespace clothstream::dtls {

// Policy: DTLS 1.2 with the ciphers of the server's other endpoints (proto/tls/ciphers.h), certificates of
// both ends, neither resumption nor renegotiation. Channels keep what they need of it. OpenSSL makes it
// thread-safe.
class DtlsContext {
 public:
  // Throws std::runtime_error if OpenSSL refuses the policy or the certificate.
  explicit DtlsContext(const Certificate& certificate);

  // A new association, which accepts the certificate with this fingerprint only. The text must outlive it.
  // Throws std::runtime_error.
  std::unique_ptr<SSL, tls::Freed<SSL_free>> newAssociation(const std::string& peerFingerprint) const;

 private:
  const std::unique_ptr<SSL_CTX, tls::Freed<SSL_CTX_free>> context_;
};

}  // namespace clothstream::dtls
