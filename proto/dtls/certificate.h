// SPDX-License-Identifier: MIT
// Certificate of one end of a DTLS association, which its fingerprint in the signalling proves.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "proto/tls/openssl.h"

namespace clothstream::dtls {

// SHA-256 of a certificate in DER, in the form of SDP (RFC 8122, section 5): "sha-256 " and 32 pairs of
// upper-case digits with colons. Throws std::runtime_error.
std::string fingerprintOf(const X509& certificate);

// The same form for a fingerprint from outside, with small or capital letters. Nothing if it is not one of
// SHA-256. RFC 8122 also has other hash functions; browsers use this one.
[[nodiscard]] std::optional<std::string> readFingerprint(std::string_view text);

// A new key of the curve P-256 with a certificate that it has signed, valid for 30 days. Peers do not check
// the validity, but the fingerprint. Immutable.
class Certificate {
 public:
  Certificate();  // throws std::runtime_error

  const std::string& fingerprint() const { return fingerprint_; }
  X509& x509() const { return *x509_; }
  EVP_PKEY& key() const { return *key_; }

 private:
  const tls::Key key_;
  const tls::X509Certificate x509_;
  const std::string fingerprint_;
};

}  // namespace clothstream::dtls
