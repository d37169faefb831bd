// SPDX-License-Identifier: MIT
// Fingerprints as the 32 bytes of a DatagramOffer or DatagramAnswer.
#pragma once

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "proto/tls/fingerprint.h"

namespace clothstream::dtls {

using Digest = std::array<std::uint8_t, 32>;

inline constexpr std::string_view kFingerprintPrefix = "sha-256 ";

// The fingerprint in the form of readFingerprint().
inline std::string fingerprintOf(const Digest& digest) {
  KeyDigest same{};
  std::copy(digest.begin(), digest.end(), same.begin());
  return std::string(kFingerprintPrefix) + fingerprintText(same);
}

// `fingerprint` is in the form of readFingerprint().
inline Digest digestOf(std::string_view fingerprint) {
  Digest digest{};
  const char* at = fingerprint.data() + kFingerprintPrefix.size();
  for (std::uint8_t& byte : digest) {
    std::from_chars(at, at + 2, byte, 16);
    at += 3;  // two digits and a colon
  }
  return digest;
}

}  // namespace clothstream::dtls
