// SPDX-License-Identifier: MIT
// Pairing codes: life, wrong attempts, and locked-out addresses.
#include "server/identity/pairing_codes.h"

#include <array>
#include <set>
#include <string>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::identity {
namespace {

using namespace std::chrono_literals;

using scene::Role;
using testing::HasSubstr;

const Clock::time_point kStart{std::chrono::hours(1)};

class PairingCodesTest : public testing::Test {
 protected:
  // Returns the error of a code that must be refused.
  std::string refusal(const std::string& code, const std::string& address, Clock::time_point now) {
    const auto role = codes.take(code, address, now);
    if (role) return "accepted";
    EXPECT_EQ(role.error().code, v1::ERROR_CODE_WRONG_PAIRING_CODE);
    return role.error().text;
  }
  static std::string other(const std::string& code) { return code == "000000" ? "000001" : "000000"; }

  PairingCodes codes;
};

TEST_F(PairingCodesTest, CodeHasSixDigitsAndGivesItsRoleUntilItEnds) {
  const PairingCode code = codes.make(Role::owner, kStart);
  EXPECT_THAT(code.code, testing::MatchesRegex("[0-9]{6}"));
  EXPECT_EQ(codes.take(code.code, "a", kStart).value(), Role::owner);
  EXPECT_EQ(codes.take(code.code, "b", kStart + 5min - 1ms).value(), Role::owner);
  EXPECT_THAT(refusal(code.code, "a", kStart + 5min), HasSubstr("there is no pairing code now"));
}

TEST_F(PairingCodesTest, RolesHaveCodesOfTheirOwn) {
  const PairingCode owner = codes.make(Role::owner, kStart), guest = codes.make(Role::participant, kStart);
  EXPECT_NE(owner.code, guest.code);
  EXPECT_EQ(codes.take(owner.code, "a", kStart).value(), Role::owner);
  EXPECT_EQ(codes.take(guest.code, "a", kStart).value(), Role::participant);
  const PairingCode newer = codes.make(Role::owner, kStart + 1min);
  EXPECT_THAT(refusal(owner.code, "a", kStart + 1min), HasSubstr("is wrong"));
  EXPECT_EQ(codes.take(newer.code, "a", kStart + 1min).value(), Role::owner);
}

TEST_F(PairingCodesTest, FiveWrongCodesLockTheAddressOutForAMinute) {
  const PairingCode code = codes.make(Role::owner, kStart);
  const std::string wrong = other(code.code);
  for (int i = 1; i < 5; ++i)
    EXPECT_THAT(refusal(wrong, "a", kStart), HasSubstr("the pairing code is wrong"));
  EXPECT_THAT(refusal(wrong, "a", kStart), HasSubstr("try again in a minute"));
  EXPECT_THAT(refusal(code.code, "a", kStart), HasSubstr("try again in a minute"));
  EXPECT_THAT(refusal(code.code, "a", kStart + 59s), HasSubstr("try again in a minute"));
  EXPECT_EQ(codes.take(code.code, "b", kStart).value(), Role::owner) << "other addresses are not affected";
  EXPECT_EQ(codes.take(code.code, "a", kStart + 1min).value(), Role::owner);
}

TEST_F(PairingCodesTest, RightCodeForgetsWrongOnes) {
  const PairingCode code = codes.make(Role::owner, kStart);
  for (int round = 0; round < 3; ++round) {
    for (int i = 0; i < 4; ++i) refusal(other(code.code), "a", kStart);
    EXPECT_EQ(codes.take(code.code, "a", kStart).value(), Role::owner);
  }
}

TEST_F(PairingCodesTest, TwentyWrongCodesOfAllAddressesEndAllCodes) {
  const PairingCode owner = codes.make(Role::owner, kStart), guest = codes.make(Role::participant, kStart);
  std::string wrong = "999999";
  if (wrong == owner.code || wrong == guest.code) wrong = "999998";
  if (wrong == owner.code || wrong == guest.code) wrong = "999997";
  for (int i = 1; i < 20; ++i)
    EXPECT_THAT(refusal(wrong, fmt::format("address {}", i), kStart), HasSubstr("is wrong"));
  EXPECT_EQ(codes.take(owner.code, "honest", kStart).value(), Role::owner);
  EXPECT_THAT(refusal(wrong, "last", kStart), HasSubstr("all codes have ended"));
  EXPECT_THAT(refusal(owner.code, "honest", kStart), HasSubstr("there is no pairing code now"));
  EXPECT_THAT(refusal(guest.code, "honest", kStart), HasSubstr("there is no pairing code now"));
  const PairingCode next = codes.make(Role::owner, kStart);
  EXPECT_EQ(codes.take(next.code, "honest", kStart).value(), Role::owner);
}

TEST_F(PairingCodesTest, AttemptsWithoutACodeAreNotCounted) {
  for (int i = 0; i < 100; ++i) refusal("123456", "a", kStart);
  const PairingCode code = codes.make(Role::owner, kStart);
  EXPECT_EQ(codes.take(code.code, "a", kStart).value(), Role::owner);
}

TEST_F(PairingCodesTest, RefusesTextOfOtherLengths) {
  const PairingCode code = codes.make(Role::owner, kStart);
  int i = 0;
  for (const std::string& text :
       {std::string(), code.code.substr(0, 5), code.code + "0", code.code + '\0', std::string(60'000, '1')})
    EXPECT_THAT(refusal(text, fmt::format("{}", i++), kStart), HasSubstr("is wrong"));
}

// A chi-squared test of the first digits; 9 degrees of freedom, the limit has a probability of 1e-9.
TEST_F(PairingCodesTest, CodesAreUniform) {
  constexpr int kDraws = 10'000;
  std::array<int, 10> counts{};
  std::set<std::string> seen;
  for (int i = 0; i < kDraws; ++i) {
    const std::string code = codes.make(Role::owner, kStart).code;
    ++counts[static_cast<std::size_t>(code[0] - '0')];
    seen.insert(code);
  }
  double chiSquared = 0;
  for (const int count : counts)
    chiSquared += (count - kDraws / 10.0) * (count - kDraws / 10.0) / (kDraws / 10.0);
  EXPECT_LT(chiSquared, 62);
  EXPECT_GT(seen.size(), 9'800u);
}

}  // namespace
}  // namespace clothstream::identity
