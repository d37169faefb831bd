// SPDX-License-Identifier: MIT
#include "proto/dtls/certificate.h"

#include <algorithm>
#include <cctype>
#include <chrono>

#include "proto/tls/fingerprint.h"
#include "proto/tls/self_signed.h"

namespace clothstream::dtls {
namespace {

constexpr std::string_view kHashFunction = "sha-256 ";
constexpr std::chrono::hours kValidity{30 * 24};
// A fingerprint has 103 bytes.
constexpr std::size_t kMaxText = 200;

}  // namespace

std::string fingerprintOf(const X509& certificate) {
  KeyDigest digest{};
  unsigned size = 0;
  tls::check(X509_digest(&certificate, EVP_sha256(), digest.data(), &size), "fingerprint");
  return std::string(kHashFunction) + fingerprintText(digest);
}

std::optional<std::string> readFingerprint(std::string_view text) {
  const auto isSame = [](char a, char b) { return std::tolower(static_cast<unsigned char>(a)) == b; };
  if (text.size() > kMaxText || text.size() < kHashFunction.size() ||
      !std::ranges::equal(text.substr(0, kHashFunction.size()), kHashFunction, isSame))
    return std::nullopt;
  const auto digits = normalFingerprint(text.substr(kHashFunction.size()));
  if (!digits) return std::nullopt;
  return std::string(kHashFunction) + *digits;
}

Certificate::Certificate()
    : key_(tls::makeKey()),
      x509_(tls::makeCertificate(*key_, kValidity, "")),
      fingerprint_(fingerprintOf(*x509_)) {}

}  // namespace clothstream::dtls
