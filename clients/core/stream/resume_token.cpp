// SPDX-License-Identifier: MIT
#include "clients/core/stream/resume_token.h"

#include <charconv>
#include <system_error>

#include "clients/core/wire/limits.h"

namespace clothstream::client {
namespace {

template <typename Integer>
bool readAll(std::string_view text, Integer& value, int base) {
  const char* const end = text.data() + text.size();
  const auto [read, error] = std::from_chars(text.data(), end, value, base);
  return error == std::errc() && read == end;
}

}  // namespace

std::string toText(const ResumeToken& token) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (const char character : token.secret) {
    const auto byte = static_cast<unsigned char>(character);
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text + '-' + std::to_string(token.attempt);
}

std::optional<ResumeToken> readResumeToken(std::string_view text) {
  const std::size_t hyphen = text.find('-');
  if (hyphen == std::string_view::npos || hyphen == 0 || hyphen % 2 != 0 || hyphen > 2 * kMaxResumeTokenBytes)
    return std::nullopt;
  ResumeToken token;
  if (!readAll(text.substr(hyphen + 1), token.attempt, 10)) return std::nullopt;
  for (std::size_t i = 0; i < hyphen; i += 2) {
    unsigned char byte = 0;
    if (!readAll(text.substr(i, 2), byte, 16)) return std::nullopt;
    token.secret += static_cast<char>(byte);
  }
  return token;
}

}  // namespace clothstream::client
