// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/token_target.h"

#include <algorithm>
#include <array>
#include <string>

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include "inputs.pb.h"
#include "server/identity/token.h"

namespace clothstream::fuzz {
namespace {

constexpr const char* kAudience = "clothstream";
const std::string kSecret(identity::kMinSecretBytes, 's');
// 2026-01-01.
const identity::WallClock::time_point kNow{std::chrono::seconds(1'767'225'600)};

// base64url without padding (RFC 4648 5).
std::string encoded(const std::string& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                      reinterpret_cast<const unsigned char*>(bytes.data()), static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  text.erase(std::find(text.begin(), text.end(), '='), text.end());
  std::ranges::replace(text, '+', '-');
  std::ranges::replace(text, '/', '_');
  return text;
}

std::string signatureOf(const std::string& content) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  HMAC(EVP_sha256(), kSecret.data(), static_cast<int>(kSecret.size()),
       reinterpret_cast<const unsigned char*>(content.data()), content.size(), digest.data(), &size);
  return {digest.begin(), digest.begin() + size};
}

void run(const TokenInput& input) {
  const identity::TokenKeys keys{
      {"key",
       {.id = "key", .algorithm = identity::Algorithm::hs256, .checking = kSecret, .signing = kSecret}}};
  std::string token = input.raw();
  if (input.raw().empty()) {
    token = encoded(input.header()) + '.' + encoded(input.claims());
    token += '.' + encoded(input.wrongly_signed() ? input.signature() : signatureOf(token));
  }
  const auto identity = identity::check(token, keys, kAudience, kNow);
  if (!identity) {
    require(!identity.error().text.empty(), "a refusal says why");
    return;
  }
  const std::size_t content = token.rfind('.');
  require(token.substr(content + 1) == encoded(signatureOf(token.substr(0, content))),
          "only tokens that the key has signed are accepted");
  require(identity->verified && identity->expires && *identity->expires > kNow,
          "accepted tokens have not expired");
  require(!identity->subject.empty(), "every identity has a subject");
}

}  // namespace

const Target kTokenTarget{
    .name = "token", .run = &runStructured<TokenInput, &run>, .structure = &TokenInput::default_instance()};

}  // namespace clothstream::fuzz
