// SPDX-License-Identifier: MIT
#include "proto/tls/fingerprint.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <memory>

#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

namespace clothstream {

constexpr std::size_t kBytes = 32;

namespace {

// Pairs of digits with colons between them.
std::string inPairs(std::string_view digits) {
  std::string text;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && i % 2 == 0) text += ':';
    text += digits[i];
  }
  return text;
}

}  // namespace

std::optional<std::string> fingerprintOf(const std::string& pem) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> bio(
      BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), &BIO_free);
  const std::unique_ptr<X509, decltype(&X509_free)> certificate(
      bio ? PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr) : nullptr, &X509_free);
  ERR_clear_error();
  return certificate ? fingerprintOf(*certificate) : std::nullopt;
}

std::optional<std::string> fingerprintOf(const x509_st& certificate) {
  unsigned char* der = nullptr;
  const int size = i2d_X509_PUBKEY(X509_get_X509_PUBKEY(&certificate), &der);
  if (size <= 0) return std::nullopt;
  std::array<unsigned char, kBytes> digest{};
  const int hashed =
      EVP_Digest(der, static_cast<std::size_t>(size), digest.data(), nullptr, EVP_sha256(), nullptr);
  OPENSSL_free(der);
  if (hashed != 1) return std::nullopt;
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string digits;
  for (const unsigned char byte : digest) digits.append({kDigits[byte >> 4], kDigits[byte & 15]});
  return inPairs(digits);
}

std::optional<std::string> normalFingerprint(std::string_view text) {
  std::string digits;
  for (const char letter : text) {
    if (letter == ':' || letter == ' ') continue;
    if (std::isxdigit(static_cast<unsigned char>(letter)) == 0 || digits.size() == 2 * kBytes)
      return std::nullopt;
    digits += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  }
  if (digits.size() != 2 * kBytes) return std::nullopt;
  return inPairs(digits);
}

}  // namespace clothstream
