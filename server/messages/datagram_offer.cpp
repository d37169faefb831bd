// SPDX-License-Identifier: MIT
#include "server/messages/datagram_offer.h"

#include <algorithm>

#include <fmt/format.h>

namespace clothstream::messages {
namespace {

constexpr std::size_t kFingerprintBytes = 32;

struct Length {
  std::size_t least, most;
};
// RFC 8839, section 5.4, and proto/ice, which accepts fragments of up to 64 characters.
constexpr Length kUfrag{4, 64}, kPassword{22, 256};

bool isIceText(const std::string& text, Length length) {
  const auto isIceChar = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '+' || c == '/';
  };
  return text.size() >= length.least && text.size() <= length.most && std::ranges::all_of(text, isIceChar);
}

// The values are secrets, so errors do not repeat them.
tl::unexpected<FieldError> refuseText(const char* field, Length length) {
  return tl::unexpected(FieldError{v1::ERROR_CODE_INVALID_ARGUMENT,
                                   fmt::format("datagram_offer.{}: must be {} to {} letters, digits, + and /",
                                               field, length.least, length.most)});
}

}  // namespace

Result<DatagramOffer> toDatagramOffer(const v1::DatagramOffer& message) {
  if (!isIceText(message.ufrag(), kUfrag)) return refuseText("ufrag", kUfrag);
  if (!isIceText(message.password(), kPassword)) return refuseText("password", kPassword);
  if (message.fingerprint().size() != kFingerprintBytes)
    return tl::unexpected(FieldError{
        v1::ERROR_CODE_INVALID_ARGUMENT,
        fmt::format("datagram_offer.fingerprint: has {} bytes, must have {}: SHA-256 of the certificate",
                    message.fingerprint().size(), kFingerprintBytes)});
  return DatagramOffer{.ufrag = message.ufrag(),
                       .password = message.password(),
                       .fingerprint = message.fingerprint(),
                       .sctp = message.sctp()};
}

}  // namespace clothstream::messages
