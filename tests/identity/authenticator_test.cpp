// SPDX-License-Identifier: MIT
// Who a peer is by its token, its pairing code, or its address.
#include "server/identity/authenticator.h"

#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "clothstream/v1/session.pb.h"
#include "server/identity/token.h"
#include "tests/identity/key_directory.h"

namespace clothstream::identity {
namespace {

using namespace std::chrono_literals;

using scene::Role;
using testing::HasSubstr;
using tests::KeyDirectory;

const Clock::time_point kBegin{std::chrono::hours(1)};

std::string tokenOf(const TokenKey& key) {
  return sign(key, {.role = Role::viewer,
                    .scene = {},
                    .name = {},
                    .subject = "ada",
                    .tenant = {},
                    .audience = "clothstream",
                    .expires = WallClock::now() + 1h,
                    .notBefore = {}});
}

TEST(AuthenticatorTest, WithoutKeysTheAddressDecides) {
  const Authenticator everyone({.keyDirectory = {}, .stateDirectory = {}, .anonymousRole = Role::viewer});
  EXPECT_FALSE(everyone.required());
  EXPECT_EQ(everyone.anonymous(true)->role, Role::owner);
  EXPECT_EQ(everyone.anonymous(false)->role, Role::viewer);
  EXPECT_FALSE(everyone.anonymous(true)->verified);
  EXPECT_EQ(everyone.verify("any", false)->role, Role::viewer) << "tokens for other servers are ignored";
}

TEST(AuthenticatorTest, WithKeysEveryPeerNeedsAToken) {
  const KeyDirectory directory;
  const TokenKey key = directory.make("a.pem");
  const Authenticator authenticator({.keyDirectory = directory.path(), .stateDirectory = {}});
  EXPECT_TRUE(authenticator.required());
  for (const bool isLoopback : {true, false})
    EXPECT_EQ(authenticator.anonymous(isLoopback).error().code, v1::ERROR_CODE_UNAUTHENTICATED);
  EXPECT_EQ(authenticator.verify(tokenOf(key), false)->subject.name, "ada");
  EXPECT_FALSE(authenticator.verify("", true));
}

TEST(AuthenticatorTest, ReloadRotatesKeysAndKeepsTheOldOnesAfterAnError) {
  const KeyDirectory directory;
  const TokenKey old = directory.make("old.pem");
  Authenticator authenticator({.keyDirectory = directory.path(), .stateDirectory = {}});
  const TokenKey next = directory.make("next.pem");
  EXPECT_FALSE(authenticator.verify(tokenOf(next), true));
  authenticator.reload();
  EXPECT_TRUE(authenticator.verify(tokenOf(next), true));
  std::filesystem::remove(directory.path() / "old.pem");
  authenticator.reload();
  EXPECT_FALSE(authenticator.verify(tokenOf(old), true));
  directory.write("bad.pem", "not a key");
  EXPECT_THROW(authenticator.reload(), std::runtime_error);
  EXPECT_TRUE(authenticator.verify(tokenOf(next), true));
}

TEST(AuthenticatorTest, IdentityEndsWithItsTokenOrKey) {
  const KeyDirectory directory;
  const TokenKey old = directory.make("old.pem"), replaced = directory.make("replaced.secret");
  Authenticator authenticator({.keyDirectory = directory.path(), .stateDirectory = {}});
  const Identity byOld = *authenticator.verify(tokenOf(old), true);
  const Identity byReplaced = *authenticator.verify(tokenOf(replaced), true);
  directory.make("next.pem");
  authenticator.reload();
  for (const Identity& identity : {byOld, byReplaced, local()})
    EXPECT_EQ(authenticator.whyEnded(identity, 0s), nullptr);
  std::filesystem::remove(directory.path() / "old.pem");
  std::filesystem::remove(directory.path() / "replaced.secret");
  directory.make("replaced.secret");
  EXPECT_EQ(authenticator.whyEnded(byOld, 0s), nullptr) << "the keys are not read before SIGHUP";
  authenticator.reload();
  for (const Identity& identity : {byOld, byReplaced})
    EXPECT_THAT(authenticator.whyEnded(identity, 0s), HasSubstr("key of your token is no longer in use"));
  EXPECT_EQ(authenticator.whyEnded(local(), 0s), nullptr) << "it has no token";
}

TEST(AuthenticatorTest, IdentityEndsAfterTheGrace) {
  const KeyDirectory directory;
  const TokenKey key = directory.make("a.pem");
  Authenticator authenticator({.keyDirectory = directory.path(), .stateDirectory = {}});
  const Identity identity = *authenticator.verify(tokenOf(key), true);
  authenticator.setClock([&] { return *identity.expires + 30s; });
  EXPECT_EQ(authenticator.whyEnded(identity, 60s), nullptr);
  EXPECT_THAT(authenticator.whyEnded(identity, 30s), HasSubstr("expired"));
}

TEST(AuthenticatorTest, PairingGivesATokenThatWorksAfterARestart) {
  const KeyDirectory state;
  std::string token, subject;
  {
    Authenticator authenticator({.keyDirectory = {}, .pairing = true, .stateDirectory = state.path()});
    EXPECT_TRUE(authenticator.required());
    const std::string code = authenticator.makeCode(Role::owner, kBegin)->code;
    const auto first = authenticator.pair(code, "a", kBegin), second = authenticator.pair(code, "b", kBegin);
    ASSERT_TRUE(first && second);
    EXPECT_NE(first->identity.subject, second->identity.subject);
    EXPECT_THAT(first->identity.subject.name, testing::MatchesRegex("paired-[0-9a-f]{16}"));
    token = first->token;
    subject = first->identity.subject.name;
  }
  struct stat status {};
  ASSERT_EQ(::stat((state.path() / "identity" / "pairing.secret").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  Authenticator again({.keyDirectory = {}, .pairing = true, .stateDirectory = state.path()});
  ASSERT_TRUE(again.verify(token, false));
  EXPECT_EQ(again.verify(token, false)->subject.name, subject);
  EXPECT_EQ(again.verify(token, false)->role, Role::owner);
  again.setClock([] { return WallClock::now() + Authenticator::kPairingValid + 1s; });
  EXPECT_THAT(again.verify(token, false).error().text, HasSubstr("expired"));
}

TEST(AuthenticatorTest, RefusesPairingThatIsOff) {
  const KeyDirectory directory;
  directory.make("a.pem");
  Authenticator authenticator({.keyDirectory = directory.path(), .stateDirectory = {}});
  EXPECT_EQ(authenticator.pair("123456", "a", kBegin).error().code, v1::ERROR_CODE_WRONG_PAIRING_CODE);
  EXPECT_EQ(authenticator.makeCode(Role::owner, kBegin).error().code, v1::ERROR_CODE_INVALID_ARGUMENT);
  EXPECT_THROW(Authenticator({.keyDirectory = {}, .pairing = true, .stateDirectory = {}}),
               std::runtime_error);
}

}  // namespace
}  // namespace clothstream::identity
