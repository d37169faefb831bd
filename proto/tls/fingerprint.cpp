// SPDX-License-Identifier: MIT
#include "proto/tls/fingerprint.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstddef>
#include <memory>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

namespace clothstream {

constexpr std::size_t kBytes = 32;

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
  return fmt::format("{:02X}", fmt::join(digest, ":"));
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
  std::string normal;
  for (std::size_t i = 0; i < digits.size(); ++i) {
    if (i > 0 && i % 2 == 0) normal += ':';
    normal += digits[i];
  }
  return normal;
}

}  // namespace clothstream
