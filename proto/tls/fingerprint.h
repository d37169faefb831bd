// SPDX-License-Identifier: MIT
// Fingerprint by which people and clients recognise a server.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

struct x509_st;  // X509 of OpenSSL

namespace clothstream {

// SHA-256 of the public key (SubjectPublicKeyInfo) of the first certificate in PEM text: 32 pairs of
// hexadecimal digits with colons. A certificate that is renewed with its key keeps it. Nothing if the text
// has no certificate.
// Both need OpenSSL, and builds for Windows have neither.
std::optional<std::string> fingerprintOf(const std::string& pem);
std::optional<std::string> fingerprintOf(const x509_st& certificate);

// SHA-256 of a public key in the form of fingerprintOf().
using KeyDigest = std::array<unsigned char, 32>;
std::string fingerprintText(const KeyDigest& digest);

// The same form for a fingerprint as a person writes it: small letters, without colons or with spaces.
// Nothing if it has not 64 hexadecimal digits.
std::optional<std::string> normalFingerprint(std::string_view text);

}  // namespace clothstream
