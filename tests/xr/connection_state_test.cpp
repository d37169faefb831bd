// SPDX-License-Identifier: MIT
#include "clients/xr/connection/connection_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::xr {
namespace {

using testing::HasSubstr;

TEST(XrConnectionState, UnreachableServerIsTriedAgain) {
  EXPECT_TRUE(retriesByItself(Step::joining, CLOTHSTREAM_UNREACHABLE));
  EXPECT_TRUE(retriesByItself(Step::pairing, CLOTHSTREAM_UNREACHABLE));
  EXPECT_TRUE(retriesByItself(Step::streaming, CLOTHSTREAM_LOST));
  const Trouble trouble =
      troubleOf(Step::joining, CLOTHSTREAM_UNREACHABLE, "Connection refused.", "host:8080");
  EXPECT_EQ(trouble.title, "The server does not answer");
  EXPECT_THAT(trouble.advice, HasSubstr("host:8080"));
  EXPECT_THAT(trouble.advice, HasSubstr("Connection refused."));
}

TEST(XrConnectionState, WrongCodeWaitsForTheUser) {
  EXPECT_FALSE(retriesByItself(Step::pairing, CLOTHSTREAM_REFUSED));
  const Trouble trouble = troubleOf(Step::pairing, CLOTHSTREAM_REFUSED, "The code is wrong.", "host");
  EXPECT_EQ(trouble.title, "The server refused the pairing code");
  EXPECT_THAT(trouble.advice, HasSubstr("--code"));
}

TEST(XrConnectionState, RefusedJoinAndBadOptionsWaitForTheUser) {
  EXPECT_FALSE(retriesByItself(Step::joining, CLOTHSTREAM_REFUSED));
  EXPECT_FALSE(retriesByItself(Step::joining, CLOTHSTREAM_INVALID));
  EXPECT_FALSE(retriesByItself(Step::streaming, CLOTHSTREAM_REFUSED));
  EXPECT_EQ(troubleOf(Step::streaming, CLOTHSTREAM_REFUSED, "An owner removed you.", "host").advice,
            "An owner removed you.");
}

TEST(XrConnectionState, WaitsLongerAfterEachFailureUpToEightSeconds) {
  EXPECT_EQ(retryDelayUs(1), 1'000'000U);
  EXPECT_EQ(retryDelayUs(2), 2'000'000U);
  EXPECT_EQ(retryDelayUs(4), 8'000'000U);
  EXPECT_EQ(retryDelayUs(1000), 8'000'000U);
}

TEST(XrConnectionState, SuccessIsNoTrouble) {
  EXPECT_EQ(troubleOf(Step::joining, CLOTHSTREAM_OK, "", "host"), Trouble{});
}

}  // namespace
}  // namespace clothstream::xr
