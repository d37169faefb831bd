// SPDX-License-Identifier: MIT
#include "server/scene/quarantine.h"

#include <chrono>

#include <gtest/gtest.h>

namespace clothstream::scene {
namespace {

TEST(Quarantine, EndsWithItsTimeUnlessForGood) {
  const auto now = schedule::Clock::time_point(std::chrono::hours(1));
  Quarantine quarantine;
  EXPECT_EQ(quarantine.reason(now), "");
  quarantine.begin("it was late", now + std::chrono::milliseconds(1500));
  EXPECT_EQ(quarantine.reason(now), "it was late; join again in 2 s");
  EXPECT_EQ(quarantine.reason(now + std::chrono::milliseconds(1500)), "");
  quarantine.begin("it harms others");
  EXPECT_EQ(quarantine.reason(now + std::chrono::hours(1)), "it harms others");
}

}  // namespace
}  // namespace clothstream::scene
