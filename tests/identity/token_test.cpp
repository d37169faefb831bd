// SPDX-License-Identifier: MIT
// Keys and tokens: what is accepted, and each reason for a refusal.
#include "server/identity/token.h"

#include <array>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <jwt.h>
#include <sys/stat.h>

#include "clothstream/v1/session.pb.h"
#include "tests/identity/key_directory.h"

namespace clothstream::identity {
namespace {

using namespace std::chrono_literals;

using testing::HasSubstr;
using testing::Not;
using tests::KeyDirectory;

const WallClock::time_point kNow{std::chrono::seconds(1'800'000'000)};

constexpr const char* kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

// Signature (r, order - s) of the ES256 signature (r, s), both as base64url without padding.
std::string withNegatedHalf(const std::string& signature) {
  const std::string alphabet = kBase64;
  std::vector<unsigned char> bytes;
  unsigned bits = 0, count = 0;
  for (const char digit : signature) {
    bits = bits << 6 | static_cast<unsigned>(alphabet.find(digit));
    count += 6;
    if (count >= 8) bytes.push_back(static_cast<unsigned char>(bits >> (count -= 8)));
  }
  constexpr std::size_t kHalf = 32;
  constexpr std::array<unsigned char, kHalf> kOrder{
      0xff, 0xff, 0xff, 0xff, 0x00, 0x00, 0x00, 0x00, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff,
      0xbc, 0xe6, 0xfa, 0xad, 0xa7, 0x17, 0x9e, 0x84, 0xf3, 0xb9, 0xca, 0xc2, 0xfc, 0x63, 0x25, 0x51};
  EXPECT_EQ(bytes.size(), 2 * kHalf);
  int borrow = 0;
  for (std::size_t i = kHalf; i-- > 0;) {
    const int difference = kOrder[i] - bytes.at(kHalf + i) - borrow;
    borrow = difference < 0 ? 1 : 0;
    bytes[kHalf + i] = static_cast<unsigned char>(difference & 0xff);
  }
  std::string text;
  bits = count = 0;
  for (const unsigned char byte : bytes) {
    bits = bits << 8 | byte;
    for (count += 8; count >= 6; count -= 6) text += alphabet[bits >> (count - 6) & 63];
  }
  if (count > 0) text += alphabet[bits << (6 - count) & 63];
  return text;
}

Claims validClaims() {
  return {.role = scene::Role::owner,
          .scene = "flag",
          .name = "Ada",
          .subject = "ada@example.org",
          .tenant = "studio",
          .audience = "clothstream",
          .expires = kNow + 1h,
          .notBefore = {}};
}

class TokenTest : public testing::Test {
 protected:
  TokenTest() {
    for (const char* name : {"new.pem", "shared.secret"}) {
      TokenKey key = directory_.make(name);
      const std::string id = key.id;
      keys_.emplace(id, std::move(key));
    }
  }

  messages::Result<Identity> check(const std::string& token, WallClock::time_point now = kNow) const {
    return identity::check(token, keys_, "clothstream", now);
  }
  // Returns the refusal, which must not contain the token.
  std::string refusal(const std::string& token, WallClock::time_point now = kNow) const {
    const auto checked = check(token, now);
    if (checked) return "accepted";
    EXPECT_EQ(checked.error().code, v1::ERROR_CODE_UNAUTHENTICATED);
    if (token.size() > 20) {
      EXPECT_THAT(checked.error().text, Not(HasSubstr(token.substr(0, 20))));
    }
    return checked.error().text;
  }
  std::string refusal(const Claims& claims, WallClock::time_point now = kNow) const {
    return refusal(sign(keys_.at("new"), claims), now);
  }
  // Token with these claims as JSON, signed by libjwt with any algorithm and bytes as key.
  static std::string custom(const std::string& json, const char* kid, jwt_alg_t algorithm,
                            const std::string& key, const char* headers = "{}") {
    jwt_t* token = nullptr;
    jwt_new(&token);
    jwt_add_grants_json(token, json.c_str());
    jwt_add_headers_json(token, headers);
    if (kid != nullptr) jwt_add_header(token, "kid", kid);
    jwt_set_alg(token, algorithm, reinterpret_cast<const unsigned char*>(key.data()),
                static_cast<int>(key.size()));
    char* text = jwt_encode_str(token);
    std::string encoded = text == nullptr ? "" : text;
    std::free(text);
    jwt_free(token);
    EXPECT_NE(encoded, "");
    return encoded;
  }
  // Token of the secret with these claims as JSON.
  std::string secret(const std::string& json) const {
    return custom(json, "shared", JWT_ALG_HS256, keys_.at("shared").signing);
  }

  KeyDirectory directory_;
  TokenKeys keys_;
};

TEST_F(TokenTest, AcceptsBothAlgorithmsWithAllClaims) {
  for (const char* id : {"new", "shared"}) {
    const auto identity = check(sign(keys_.at(id), validClaims()));
    ASSERT_TRUE(identity) << identity.error().text;
    EXPECT_TRUE(identity->verified);
    EXPECT_EQ(identity->role, scene::Role::owner);
    EXPECT_EQ(identity->scene, "flag");
    EXPECT_EQ(identity->displayName, "Ada");
    EXPECT_EQ(identity->subject, (scene::Subject{.tenant = "studio", .name = "ada@example.org"}));
    EXPECT_EQ(identity->expires, kNow + 1h);
  }
}

TEST_F(TokenTest, PublicKeyIsEnoughToCheck) {
  const TokenKey& pair = keys_.at("new");
  KeyDirectory other;
  const TokenKey onlyPublic = readTokenKey(other.write("new.pem", pair.checking));
  EXPECT_EQ(onlyPublic.signing, "");
  EXPECT_TRUE(identity::check(sign(pair, validClaims()), {{"new", onlyPublic}}, "clothstream", kNow));
  EXPECT_THROW(sign(onlyPublic, validClaims()), std::runtime_error);
}

TEST_F(TokenTest, DefaultsAreParticipantOfEveryScene) {
  const auto identity = check(secret(R"({"aud": "clothstream", "exp": 1800000060})"));
  ASSERT_TRUE(identity) << identity.error().text;
  EXPECT_EQ(identity->role, scene::Role::participant);
  EXPECT_EQ(identity->scene, "");
  EXPECT_THAT(identity->subject.name, testing::StartsWith("token-"));
}

TEST_F(TokenTest, AudienceMayBeAList) {
  EXPECT_TRUE(check(secret(R"({"aud": ["other", "clothstream"], "exp": 1800000060})")));
  EXPECT_THAT(refusal(secret(R"({"aud": ["other"], "exp": 1800000060})")), HasSubstr("audience"));
  EXPECT_THAT(refusal(secret(R"({"aud": {"clothstream": "clothstream"}, "exp": 1800000060})")),
              HasSubstr("audience"));
  EXPECT_THAT(refusal(secret(R"({"exp": 1800000060})")), HasSubstr("audience"));
}

TEST_F(TokenTest, RefusesAlgorithmNone) {
  const std::string json = R"({"aud": "clothstream", "exp": 1800000060, "role": "owner"})";
  EXPECT_THAT(refusal(custom(json, "new", JWT_ALG_NONE, "")), HasSubstr("algorithm is not ES256"));
  EXPECT_THAT(refusal(custom(json, "shared", JWT_ALG_NONE, "")), HasSubstr("algorithm is not HS256"));
  EXPECT_THAT(refusal(custom(json, nullptr, JWT_ALG_NONE, "")), HasSubstr("names no key"));
}

TEST_F(TokenTest, RefusesPublicKeyAsSecret) {
  const std::string json = R"({"aud": "clothstream", "exp": 1800000060, "role": "owner"})";
  EXPECT_THAT(refusal(custom(json, "new", JWT_ALG_HS256, keys_.at("new").checking)),
              HasSubstr("algorithm is not ES256"));
}

TEST_F(TokenTest, RefusesOtherAlgorithmsOfTheSameKey) {
  const std::string json = R"({"aud": "clothstream", "exp": 1800000060})";
  EXPECT_THAT(refusal(custom(json, "shared", JWT_ALG_HS512, keys_.at("shared").signing)),
              HasSubstr("algorithm is not HS256"));
}

TEST_F(TokenTest, RefusesUnknownOrMissingKey) {
  Claims claims = validClaims();
  KeyDirectory other;
  EXPECT_THAT(refusal(sign(other.make("old.pem"), claims)), HasSubstr("(kid)"));
  EXPECT_THAT(refusal(custom(R"({"aud": "clothstream"})", nullptr, JWT_ALG_HS256, "x")),
              HasSubstr("names no key (kid)"));
}

// RFC 7515 4.1.11
TEST_F(TokenTest, RefusesExtensionsThatItMustUnderstand) {
  const auto with = [&](const char* headers) {
    return refusal(custom(R"({"aud": "clothstream", "exp": 1800000060})", "shared", JWT_ALG_HS256,
                          keys_.at("shared").signing, headers));
  };
  EXPECT_EQ(with(R"({"other": 1})"), "accepted") << "headers that need not be understood are ignored";
  for (const char* headers : {R"({"crit": ["exp"], "exp": 1})", R"({"crit": ["b64"], "b64": false})",
                              R"({"crit": []})", R"({"crit": "x"})", R"({"crit": null})"})
    EXPECT_THAT(with(headers), HasSubstr("requires an extension (crit)")) << headers;
}

TEST_F(TokenTest, RefusesWrongSignature) {
  KeyDirectory other;
  EXPECT_THAT(refusal(sign(other.make("new.pem"), validClaims())), HasSubstr("signature"));
  EXPECT_THAT(refusal(sign(other.make("shared.secret"), validClaims())), HasSubstr("signature"));
  // Claims of one token with the signature of another.
  Claims viewer = validClaims();
  viewer.role = scene::Role::viewer;
  const std::string strong = sign(keys_.at("new"), validClaims()), weak = sign(keys_.at("new"), viewer);
  EXPECT_THAT(refusal(strong.substr(0, strong.rfind('.')) + weak.substr(weak.rfind('.'))),
              HasSubstr("signature"));
  EXPECT_THAT(refusal(strong.substr(0, strong.rfind('.') + 1)), HasSubstr("signature"));
}

TEST_F(TokenTest, RefusesWrongTimes) {
  Claims claims = validClaims();
  EXPECT_THAT(refusal(claims, kNow + 1h), HasSubstr("expired"));
  claims.notBefore = kNow + kLeeway + 1s;
  EXPECT_THAT(refusal(claims), HasSubstr("not valid yet"));
  EXPECT_EQ(refusal(claims, kNow + 1s), "accepted") << "clocks may differ by the leeway";
  claims.expires.reset();
  claims.notBefore.reset();
  EXPECT_THAT(refusal(claims), HasSubstr("no expiry"));
  for (const char* time : {"\"1800000060\"", "1800000060.5", "-1", "0", "null", "[1800000060]", "1e300"})
    EXPECT_THAT(refusal(secret(std::string(R"({"aud": "clothstream", "exp": )") + time + "}")),
                HasSubstr("exp must be whole seconds"))
        << time;
  EXPECT_EQ(refusal(secret(R"({"aud": "clothstream", "exp": 9007199254740991})")), "accepted");
}

TEST_F(TokenTest, RefusesClaimsOfWrongTypes) {
  // A scene of a wrong type must not mean every scene.
  for (const char* claim :
       {R"("scene": 5)", R"("scene": ["flag"])", R"("scene": "")", R"("scene": null)", R"("sub": 7)",
        R"("tenant": {})", R"("name": true)", R"("role": "admin")", R"("role": 3)"}) {
    const std::string json = std::string(R"({"aud": "clothstream", "exp": 1800000060, )") + claim + "}";
    EXPECT_THAT(refusal(secret(json)), HasSubstr("its claim ")) << claim;
  }
  EXPECT_THAT(refusal(secret(R"({"aud": "clothstream", "exp": 1800000060, "name": ")" +
                             std::string(129, 'x') + "\"}")),
              HasSubstr("its claim name must be a string of 1 to 128 bytes"));
}

TEST_F(TokenTest, RefusesTextThatIsNoToken) {
  for (const std::string& text :
       {std::string("x"), std::string("a.b"), std::string("a.b.c"), std::string("..."), std::string(".."),
        std::string("a b.c.d"), std::string("\0.\0.\0", 5), std::string("eyJhbGciOiJub25lIn0.e30.")})
    EXPECT_THAT(refusal(text), HasSubstr("the token is not valid")) << text;
  EXPECT_THAT(refusal(std::string(kMaxTokenBytes + 1, 'a')), HasSubstr("at most 4096"));
}

// Every token with one changed character is refused, or proves the same identity. The last character has bits
// that are not used.
TEST_F(TokenTest, ChangedTokensAreRefusedOrProveTheSame) {
  Claims claims = validClaims();
  claims.subject.clear();
  for (const char* id : {"new", "shared"}) {
    const std::string token = sign(keys_.at(id), claims);
    const std::string subject = check(token)->subject.name;
    EXPECT_THAT(subject, testing::StartsWith("token-"));
    for (std::size_t i = 0; i < token.size(); ++i) {
      // All other last characters are tried, because some differ only in unused bits.
      const bool isLast = i == token.size() - 1;
      for (const char other : std::string_view(isLast ? kBase64 : "AB")) {
        std::string changed = token;
        changed[i] = other;
        const auto identity = check(changed);
        if (changed == token || !identity) continue;
        EXPECT_TRUE(isLast) << i;
        EXPECT_EQ(identity->subject.name, subject);
      }
    }
  }
}

// A holder of a token can negate the second half of its ES256 signature, modulo the order of the curve.
TEST_F(TokenTest, NegatedSignatureProvesTheSameSubject) {
  Claims claims = validClaims();
  claims.subject.clear();
  const std::string token = sign(keys_.at("new"), claims);
  const std::size_t dot = token.rfind('.');
  const std::string negated = token.substr(0, dot + 1) + withNegatedHalf(token.substr(dot + 1));
  ASSERT_NE(negated, token);
  const auto first = check(token), second = check(negated);
  ASSERT_TRUE(first && second);
  EXPECT_EQ(first->subject, second->subject);
}

TEST(TokenKeyTest, NewKeysArePrivateFilesThatAreNotOverwritten) {
  const KeyDirectory directory;
  for (const char* name : {"a.pem", "a.secret"}) {
    const auto file = directory.path() / name;
    makeTokenKey(file);
    struct stat status {};
    ASSERT_EQ(::stat(file.c_str(), &status), 0);
    EXPECT_EQ(status.st_mode & 0777, 0600u);
    std::ifstream in(file);
    const std::string before{std::istreambuf_iterator<char>(in), {}};
    EXPECT_THROW(makeTokenKey(file), std::runtime_error);
    EXPECT_EQ(readTokenKey(file).id, "a");
    std::ifstream again(file);
    EXPECT_EQ((std::string{std::istreambuf_iterator<char>(again), {}}), before);
  }
  EXPECT_THROW(makeTokenKey(directory.path() / "a.key"), std::runtime_error);
  const auto files = std::filesystem::directory_iterator(directory.path());
  EXPECT_EQ(std::distance(begin(files), end(files)), 2) << "no draft is left";
}

TEST(TokenKeyTest, NamesReasonWhenAKeyCannotBeMade) {
  const KeyDirectory directory;
  directory.make("a.pem");
  EXPECT_THAT([&] { makeTokenKey(directory.path() / "a.pem"); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("a.pem: cannot be made: File exists")));
  EXPECT_THAT([&] { makeTokenKey(directory.path() / "none" / "a.pem"); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("cannot be written: No such file")));
}

TEST(TokenKeyTest, KnowsWhetherOtherUsersCanReadASecret) {
  using std::filesystem::perms;
  const KeyDirectory directory;
  EXPECT_FALSE(directory.make("a.pem").exposed);
  const auto file = directory.path() / "a.pem";
  std::filesystem::permissions(file, perms::owner_read | perms::owner_write | perms::group_read);
  EXPECT_TRUE(readTokenKey(file).exposed);
  const auto isPublic = directory.write("b.pem", readTokenKey(file).checking);
  std::filesystem::permissions(isPublic, perms::owner_read | perms::others_read);
  EXPECT_FALSE(readTokenKey(isPublic).exposed) << "a public key is no secret";
}

TEST(TokenKeyTest, RefusesKeysThatDoNotFit) {
  const KeyDirectory directory;
  const auto problem = [&](const std::string& name, const std::string& content) {
    try {
      readTokenKey(directory.write(name, content));
    } catch (const std::runtime_error& error) {
      EXPECT_THAT(error.what(), HasSubstr(name));
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_THAT(problem("short.secret", std::string(31, 'x')), HasSubstr("at least 32"));
  EXPECT_THAT(problem("spaces.secret", std::string(31, 'x') + "  \n"), HasSubstr("at least 32"));
  EXPECT_EQ(problem("long.secret", std::string(32, 'x')), "accepted");
  EXPECT_THAT(problem("empty.pem", ""), HasSubstr("no public or private key"));
  EXPECT_THAT(problem("a b.secret", std::string(32, 'x')), HasSubstr("1 to 64 characters"));
  EXPECT_THAT(problem("huge.secret", std::string(100'000, 'x')), HasSubstr("too large"));
}

TEST(TokenKeyTest, RefusesAFifoWithoutWaitingForItsWriter) {
  const KeyDirectory directory;
  ASSERT_EQ(::mkfifo((directory.path() / "fifo.pem").c_str(), S_IRUSR | S_IWUSR), 0);
  try {
    readTokenKeys(directory.path());
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_THAT(error.what(), testing::AllOf(HasSubstr("fifo.pem"), HasSubstr("not a regular file")));
  }
}

TEST(TokenKeyTest, RefusesOtherCurves) {
  const KeyDirectory directory;
  const auto file = directory.path() / "p384.pem";
  const std::string command = "openssl genpkey -algorithm EC -pkeyopt ec_paramgen_curve:P-384 -out '" +
                              file.string() + "' 2>/dev/null";
  if (std::system(command.c_str()) != 0) GTEST_SKIP() << "the program openssl is not installed";
  EXPECT_THAT([&] { readTokenKey(file); }, testing::ThrowsMessage<std::runtime_error>(HasSubstr("P-256")));
}

TEST(TokenKeyTest, ReadsADirectory) {
  const KeyDirectory directory;
  EXPECT_THAT([&] { readTokenKeys(directory.path()); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("has no key")));
  directory.make("one.pem");
  directory.make("two.secret");
  directory.write("readme.txt", "not a key");
  EXPECT_EQ(readTokenKeys(directory.path()).size(), 2u);
  directory.make("one.secret");
  EXPECT_THAT([&] { readTokenKeys(directory.path()); },
              testing::ThrowsMessage<std::runtime_error>(HasSubstr("same name")));
  EXPECT_THROW(readTokenKeys(directory.path() / "none"), std::runtime_error);
}

}  // namespace
}  // namespace clothstream::identity
