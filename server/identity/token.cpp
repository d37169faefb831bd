// SPDX-License-Identifier: MIT
#include "server/identity/token.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>
#include <google/protobuf/struct.pb.h>
#include <google/protobuf/util/json_util.h>
#include <jwt.h>
#include <openssl/evp.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::identity {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

constexpr std::size_t kMaxClaimBytes = 128;
// Whole numbers up to this one are exact in JSON.
constexpr double kMaxSeconds = 9007199254740992.0;

struct Free {
  void operator()(jwt_t* token) const { jwt_free(token); }
  void operator()(char* text) const { std::free(text); }
};
using Token = std::unique_ptr<jwt_t, Free>;
using Text = std::unique_ptr<char, Free>;

tl::unexpected<messages::FieldError> refused(std::string why) {
  return tl::unexpected(
      messages::FieldError{v1::ERROR_CODE_UNAUTHENTICATED, "the token is not valid: " + std::move(why)});
}

// Checks the signature if `key` is not null.
Token decode(const std::string& token, const TokenKey* key) {
  jwt_t* decoded = nullptr;
  const auto* const bytes =
      key == nullptr ? nullptr : reinterpret_cast<const unsigned char*>(key->checking.data());
  const int size = key == nullptr ? 0 : static_cast<int>(key->checking.size());
  return Token(jwt_decode(&decoded, token.c_str(), bytes, size) == 0 ? decoded : nullptr);
}

jwt_alg_t toJwt(Algorithm algorithm) {
  return algorithm == Algorithm::es256 ? JWT_ALG_ES256 : JWT_ALG_HS256;
}

// Reads claims and remembers the first that is wrong. libjwt's own functions take a claim of a wrong type for
// an absent one.
class ClaimReader {
 public:
  explicit ClaimReader(const Struct& claims) : claims_(claims) {}

  std::string text(const char* name) {
    const Value* value = find(name);
    if (value == nullptr) return {};
    // An empty scene must not mean every scene.
    if (!value->has_string_value() || value->string_value().empty() ||
        value->string_value().size() > kMaxClaimBytes) {
      fail(name, fmt::format("must be a string of 1 to {} bytes", kMaxClaimBytes));
      return {};
    }
    return value->string_value();
  }
  std::optional<WallClock::time_point> time(const char* name) {
    const Value* value = find(name);
    if (value == nullptr) return std::nullopt;
    const double seconds = value->number_value();
    if (!value->has_number_value() || !(seconds > 0 && seconds < kMaxSeconds) ||
        std::floor(seconds) != seconds) {
      fail(name, "must be whole seconds since 1970");
      return std::nullopt;
    }
    // Later times than the clock can represent are the same as its end.
    constexpr auto kLatest =
        std::chrono::duration_cast<std::chrono::seconds>(WallClock::duration::max()).count();
    const auto whole = std::min<std::int64_t>(static_cast<std::int64_t>(seconds), kLatest);
    return WallClock::time_point(std::chrono::seconds(whole));
  }
  // Returns whether the claim `aud`, a string or a list of strings, contains the audience.
  bool isFor(const std::string& audience) const {
    const Value* value = find("aud");
    if (value == nullptr) return false;
    if (value->has_string_value()) return value->string_value() == audience;
    for (const Value& entry : value->list_value().values())
      if (entry.has_string_value() && entry.string_value() == audience) return true;
    return false;
  }

  void fail(const char* name, std::string_view what) {
    if (problem_.empty()) problem_ = fmt::format("its claim {} {}", name, what);
  }
  const std::string& problem() const { return problem_; }

 private:
  const Value* find(const char* name) const {
    const auto found = claims_.fields().find(name);
    return found == claims_.fields().end() ? nullptr : &found->second;
  }

  const Struct& claims_;
  std::string problem_;
};

std::optional<scene::Role> roleNamed(const std::string& name) {
  for (const scene::Role role : {scene::Role::viewer, scene::Role::participant, scene::Role::owner})
    if (name == scene::nameOf(role)) return role;
  return std::nullopt;
}

// Identifies a token without a subject. Only header and claims count: a holder of a token can write its
// signature in several ways.
std::string digestOf(const std::string& token) {
  const std::string_view content = std::string_view(token).substr(0, token.rfind('.'));
  constexpr std::size_t kShownBytes = 8;
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  if (EVP_Digest(content.data(), content.size(), digest.data(), &size, EVP_sha256(), nullptr) != 1)
    return "token";
  std::string text = "token-";
  for (std::size_t i = 0; i < kShownBytes; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

bool hasForm(const std::string& token) {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_.";
  return token.find_first_not_of(kAllowed) == std::string::npos &&
         std::count(token.begin(), token.end(), '.') == 2;
}

messages::Result<Struct> claimsOf(jwt_t* token) {
  const Text json(jwt_get_grants_json(token, nullptr));
  Struct claims;
  if (!json || !google::protobuf::util::JsonStringToMessage(json.get(), &claims).ok())
    return refused("its claims cannot be read");
  return claims;
}

messages::Result<Identity> identityIn(const std::string& token, const Struct& content,
                                      const std::string& audience, WallClock::time_point now) {
  ClaimReader claims(content);
  if (!claims.isFor(audience))
    return refused(fmt::format("its audience (aud) is not '{}', which --token-audience sets", audience));
  Identity identity;
  identity.verified = true;
  identity.expires = claims.time("exp");
  const auto notBefore = claims.time("nbf");
  const std::string role = claims.text("role");
  if (role.empty())
    identity.role = scene::Role::participant;
  else if (const auto known = roleNamed(role))
    identity.role = *known;
  else
    claims.fail("role", "must be viewer, participant or owner");
  identity.subject = {.tenant = claims.text("tenant"), .name = claims.text("sub")};
  identity.displayName = claims.text("name");
  identity.scene = claims.text("scene");
  if (!claims.problem().empty()) return refused(claims.problem());
  if (!identity.expires) return refused("it has no expiry (exp)");
  if (*identity.expires <= now) return refused("it has expired; get a new one");
  if (notBefore && *notBefore - kLeeway > now) return refused("it is not valid yet (nbf)");
  if (identity.subject.empty()) identity.subject.name = digestOf(token);
  return identity;
}

}  // namespace

std::string sign(const TokenKey& key, const Claims& claims) {
  if (key.signing.empty())
    throw std::runtime_error(fmt::format("{}: is a public key; signing needs the private one", key.id));
  jwt_t* made = nullptr;
  if (jwt_new(&made) != 0) throw std::runtime_error("the token cannot be signed");
  const Token token(made);
  int failed = 0;
  const auto add = [&](const char* name, const std::string& value) {
    if (!value.empty()) failed |= jwt_add_grant(made, name, value.c_str());
  };
  const auto addTime = [&](const char* name, const std::optional<WallClock::time_point>& time) {
    if (time)
      failed |= jwt_add_grant_int(
          made, name, std::chrono::duration_cast<std::chrono::seconds>(time->time_since_epoch()).count());
  };
  add("role", scene::nameOf(claims.role));
  add("scene", claims.scene);
  add("name", claims.name);
  add("sub", claims.subject);
  add("tenant", claims.tenant);
  add("aud", claims.audience);
  addTime("exp", claims.expires);
  addTime("nbf", claims.notBefore);
  failed |= jwt_add_header(made, "kid", key.id.c_str());
  failed |=
      jwt_set_alg(made, toJwt(key.algorithm), reinterpret_cast<const unsigned char*>(key.signing.data()),
                  static_cast<int>(key.signing.size()));
  const Text text(failed == 0 ? jwt_encode_str(made) : nullptr);
  if (!text) throw std::runtime_error("the token cannot be signed");
  return text.get();
}

messages::Result<Identity> check(const std::string& token, const TokenKeys& keys, const std::string& audience,
                                 WallClock::time_point now) {
  if (token.size() > kMaxTokenBytes)
    return refused(fmt::format("it has {} bytes, and at most {} are allowed", token.size(), kMaxTokenBytes));
  if (!hasForm(token)) return refused("it is not a JSON Web Token");
  // The header is read first, without the key. The key then decides on the algorithm: a public key can never
  // be used as the secret of HS256, and `none` belongs to no key.
  const Token unchecked = decode(token, nullptr);
  if (!unchecked) return refused("it is not a JSON Web Token with a known algorithm");
  // RFC 7515 4.1.11: extensions in this list change what the token means, and this server knows none.
  if (const Text critical(jwt_get_headers_json(unchecked.get(), "crit")); critical)
    return refused("it requires an extension (crit), and this server knows none");
  const char* const id = jwt_get_header(unchecked.get(), "kid");
  if (id == nullptr) return refused("it names no key (kid)");
  const auto key = keys.find(id);
  if (key == keys.end()) return refused("the server has no key with its name (kid)");
  // jwt_get_alg() says `none` for every token that was decoded without a key.
  const char* const algorithm = jwt_get_header(unchecked.get(), "alg");
  if (algorithm == nullptr || std::string_view(algorithm) != nameOf(key->second.algorithm))
    return refused(fmt::format("its algorithm is not {}, the one of its key", nameOf(key->second.algorithm)));
  const Token checked = decode(token, &key->second);
  if (!checked || jwt_get_alg(checked.get()) != toJwt(key->second.algorithm))
    return refused("its signature is wrong");
  const messages::Result<Struct> claims = claimsOf(checked.get());
  if (!claims) return tl::unexpected(claims.error());
  messages::Result<Identity> identity = identityIn(token, *claims, audience, now);
  if (identity) {
    identity->keyId = key->second.id;
    identity->keyDigest = key->second.digest;
  }
  return identity;
}

}  // namespace clothstream::identity
