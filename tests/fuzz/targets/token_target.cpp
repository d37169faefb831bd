// SPDX-License-Identifier: MIT
#include "tests/fuzz/targets/token_target.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include <openssl/ecdsa.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <openssl/pem.h>

#include "inputs.pb.h"
#include "server/identity/token.h"
#include "tests/e2e/temporary_directory.h"
#include "tests/fuzz/targets/temporary_file.h"

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

using PrivateKey = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

PrivateKey privateKeyOf(const std::string& pem) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> bytes(
      BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size())), &BIO_free);
  return {PEM_read_bio_PrivateKey(bytes.get(), nullptr, nullptr, nullptr), &EVP_PKEY_free};
}

// A key of the curve P-256.
const identity::TokenKey& ellipticKey() {
  static const identity::TokenKey key = [] {
    const e2e::TemporaryDirectory directory;
    identity::makeTokenKey(directory.path() / "key.pem");
    return identity::readTokenKey(directory.path() / "key.pem");
  }();
  return key;
}

// Numbers r and s of the signature, 32 bytes each, most significant first (RFC 7518 3.4).
std::string ellipticSignatureOf(const std::string& content) {
  static const PrivateKey key = privateKeyOf(ellipticKey().signing);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), &EVP_MD_CTX_free);
  std::array<unsigned char, 256> der{};
  std::size_t size = der.size();
  require(EVP_DigestSignInit(context.get(), nullptr, EVP_sha256(), nullptr, key.get()) == 1 &&
              EVP_DigestSign(context.get(), der.data(), &size,
                             reinterpret_cast<const unsigned char*>(content.data()), content.size()) == 1,
          "the key signs");
  const unsigned char* at = der.data();
  const std::unique_ptr<ECDSA_SIG, decltype(&ECDSA_SIG_free)> signature(
      d2i_ECDSA_SIG(nullptr, &at, static_cast<long>(size)), &ECDSA_SIG_free);
  std::string bytes(64, '\0');
  auto* to = reinterpret_cast<unsigned char*>(bytes.data());
  BN_bn2binpad(ECDSA_SIG_get0_r(signature.get()), to, 32);
  BN_bn2binpad(ECDSA_SIG_get0_s(signature.get()), to + 32, 32);
  return bytes;
}

// Reads the file as a key. What is accepted signs tokens that it accepts.
void readKeyFile(const TokenInput& input) {
  const TemporaryFile file(input.secret() ? ".secret" : ".pem", std::as_bytes(std::span(input.key_file())));
  try {
    const identity::TokenKey key = identity::readTokenKey(file.path());
    require(!key.id.empty() && !key.checking.empty(), "a key has a name and checks tokens");
    if (key.signing.empty()) return;
    identity::Claims claims;
    claims.subject = "ada";
    claims.audience = kAudience;
    claims.expires = kNow + std::chrono::hours(1);
    const std::string token = identity::sign(key, claims);
    require(identity::check(token, {{key.id, key}}, kAudience, kNow).has_value(),
            "a key accepts the tokens that it signs");
  } catch (const std::runtime_error& refused) {
    require(std::string_view(refused.what()).find(file.path().filename().string()) != std::string_view::npos,
            "an error names the file");
  }
}

void run(const TokenInput& input) {
  if (!input.key_file().empty()) return readKeyFile(input);
  const identity::TokenKeys keys{{"key", input.es256()
                                             ? ellipticKey()
                                             : identity::TokenKey{.id = "key",
                                                                  .algorithm = identity::Algorithm::hs256,
                                                                  .checking = kSecret,
                                                                  .signing = kSecret}}};
  std::string token = input.raw();
  if (input.raw().empty()) {
    token = encoded(input.header()) + '.' + encoded(input.claims());
    token += '.' + encoded(input.wrongly_signed() ? input.signature()
                           : input.es256()        ? ellipticSignatureOf(token)
                                                  : signatureOf(token));
  }
  const auto identity = identity::check(token, keys, kAudience, kNow);
  if (!identity) {
    require(!identity.error().text.empty(), "a refusal says why");
    return;
  }
  const std::size_t content = token.rfind('.');
  // Signatures with ES256 are random, so only those that the fuzzer has made itself are known to be right.
  require(input.es256() ? input.raw().empty() && !input.wrongly_signed()
                        : token.substr(content + 1) == encoded(signatureOf(token.substr(0, content))),
          "only tokens that the key has signed are accepted");
  require(identity->verified && identity->expires && *identity->expires > kNow,
          "accepted tokens have not expired");
  require(!identity->subject.empty(), "every identity has a subject");
}

}  // namespace

const Target kTokenTarget{
    .name = "token", .run = &runStructured<TokenInput, &run>, .structure = &TokenInput::default_instance()};

}  // namespace clothstream::fuzz
