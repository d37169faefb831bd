// SPDX-License-Identifier: MIT
#include "clients/xr/connection/connection_state.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::xr {
namespace {

using testing::HasSubstr;

TEST(XrConnectionState, UnreachableServerIsTriedAgain) {
  EXPECT_TRUE(retriesByItself(CLOTHSTREAM_UNREACHABLE));
  EXPECT_TRUE(retriesByItself(CLOTHSTREAM_LOST));
  const Trouble trouble = troubleOf(Step::joining, CLOTHSTREAM_UNREACHABLE, "host:8080 is closed");
  EXPECT_EQ(trouble.title, "The server does not answer");
  EXPECT_EQ(trouble.advice, "host:8080 is closed. The next attempt follows by itself.");
}

TEST(XrConnectionState, OnlyWhatIsTriedAgainSaysSo) {
  for (const Step step : {Step::pairing, Step::joining, Step::streaming}) {
    for (int result = CLOTHSTREAM_INVALID; result <= CLOTHSTREAM_FAILED; ++result) {
      const auto each = static_cast<clothstream_result>(result);
      const bool saysSo =
          troubleOf(step, each, "Why.").advice.ends_with("The next attempt follows by itself.");
      EXPECT_EQ(saysSo, retriesByItself(each)) << result;
    }
  }
}

TEST(XrConnectionState, BadOptionsAreThoseOfTheProgram) {
  EXPECT_EQ(troubleOf(Step::joining, CLOTHSTREAM_INVALID,
                      "options->ca_file and options->fingerprint are both set; use one of them.")
                .advice,
            "--ca and --fingerprint are both set; use one of them.");
}

TEST(XrConnectionState, WrongCodeWaitsForTheUser) {
  EXPECT_FALSE(retriesByItself(CLOTHSTREAM_REFUSED));
  const Trouble trouble = troubleOf(Step::pairing, CLOTHSTREAM_REFUSED, "The code is wrong.");
  EXPECT_EQ(trouble.title, "The server refused the pairing code");
  EXPECT_THAT(trouble.advice, HasSubstr("--code"));
}

TEST(XrConnectionState, RefusedJoinAndBadOptionsWaitForTheUser) {
  EXPECT_FALSE(retriesByItself(CLOTHSTREAM_REFUSED));
  EXPECT_FALSE(retriesByItself(CLOTHSTREAM_INVALID));
  EXPECT_EQ(troubleOf(Step::streaming, CLOTHSTREAM_REFUSED, "An owner removed you.").advice,
            "An owner removed you.");
}

TEST(XrConnectionState, WaitsLongerAfterEachFailureUpToEightSeconds) {
  EXPECT_EQ(retryDelayUs(1), 1'000'000U);
  EXPECT_EQ(retryDelayUs(2), 2'000'000U);
  EXPECT_EQ(retryDelayUs(4), 8'000'000U);
  EXPECT_EQ(retryDelayUs(1000), 8'000'000U);
}

TEST(XrConnectionState, SuccessIsNoTrouble) {
  EXPECT_EQ(troubleOf(Step::joining, CLOTHSTREAM_OK, ""), Trouble{});
}

}  // namespace
}  // namespace clothstream::xr
