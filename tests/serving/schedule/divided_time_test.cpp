// SPDX-License-Identifier: MIT
#include "server/schedule/divided_time.h"

#include <cstdint>
#include <numeric>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace clothstream::schedule {
namespace {

using namespace std::chrono_literals;
using testing::ElementsAre;
using testing::IsEmpty;

std::vector<Clock::duration> divided(Clock::duration time, const std::vector<double>& work) {
  std::vector<Clock::duration> parts(work.size(), 1s);
  divideTime(time, work, parts);
  return parts;
}

TEST(DividedTime, PartsAreInProportionToWork) {
  EXPECT_THAT(divided(8ms, {1, 2, 5}), ElementsAre(1ms, 2ms, 5ms));
  EXPECT_THAT(divided(3ms, {7}), ElementsAre(3ms));
}

TEST(DividedTime, MembersWithoutWorkGetNothing) {
  EXPECT_THAT(divided(4ms, {0, 1, 0, 3, 0}), ElementsAre(0ns, 1ms, 0ns, 3ms, 0ns));
  EXPECT_THAT(divided(4ms, {0, 0}), ElementsAre(0ns, 0ns));
}

TEST(DividedTime, NothingIsDivided) {
  EXPECT_THAT(divided(4ms, {}), IsEmpty());
  EXPECT_THAT(divided(0ns, {1, 2}), ElementsAre(0ns, 0ns));
}

// Thirds and tenths have no exact value.
TEST(DividedTime, SumIsExact) {
  for (std::int64_t nanoseconds : {1L, 2L, 97L, 1'000'003L, 12'345'678'901L}) {
    const Clock::duration time(nanoseconds);
    std::vector<double> work;
    for (int members = 1; members <= 1'000; ++members) {
      work.push_back(members % 7 == 0 ? 0 : members % 3 == 0 ? 0.1 : 1e6 / members);
      if (members % 50 > 1) continue;
      const std::vector<Clock::duration> parts = divided(time, work);
      EXPECT_EQ(std::accumulate(parts.begin(), parts.end(), Clock::duration{}), time);
      EXPECT_THAT(parts, testing::Each(testing::Ge(Clock::duration::zero())));
    }
  }
}

}  // namespace
}  // namespace clothstream::schedule
