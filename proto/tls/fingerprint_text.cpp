// SPDX-License-Identifier: MIT
// Fingerprints as text, without OpenSSL.
#include <cctype>
#include <cstddef>

#include "proto/tls/fingerprint.h"

namespace clothstream {
namespace {

constexpr std::size_t kDigitCount = 2 * std::tuple_size_v<KeyDigest>;

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

std::string fingerprintText(const KeyDigest& digest) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string digits;
  for (const unsigned char byte : digest) digits.append({kDigits[byte >> 4], kDigits[byte & 15]});
  return inPairs(digits);
}

std::optional<std::string> normalFingerprint(std::string_view text) {
  std::string digits;
  for (const char letter : text) {
    if (letter == ':' || letter == ' ') continue;
    if (std::isxdigit(static_cast<unsigned char>(letter)) == 0 || digits.size() == kDigitCount)
      return std::nullopt;
    digits += static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
  }
  if (digits.size() != kDigitCount) return std::nullopt;
  return inPairs(digits);
}

}  // namespace clothstream
