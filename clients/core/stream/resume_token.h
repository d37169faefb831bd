// SPDX-License-Identifier: MIT
// Text form of what a client needs to return as its participant (cs_resume_token).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace clothstream::client {

struct ResumeToken {
  std::string secret;         // Hello.resume_token
  std::uint32_t attempt = 0;  // Hello.attempt of the connection that has it
};

// Hexadecimal digits of the secret, a hyphen, and the attempt.
std::string toText(const ResumeToken& token);
// nullopt if toText has not made the text. A secret has 1 to kMaxResumeTokenBytes bytes.
std::optional<ResumeToken> readResumeToken(std::string_view text);

}  // namespace clothstream::client
