// SPDX-License-Identifier: MIT
// Text of the metrics, and log levels.
#include "server/telemetry/metrics.h"

#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include "server/telemetry/log.h"

namespace clothstream::telemetry {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Table, ShowsRecordedStagesInMillisecondsAndOmitsOthers) {
  SceneMetrics metrics;
  metrics.tick.record(0.25);
  metrics.device.record("springs", 0.125);
  metrics.ticks.add(3);
  const std::string text = table("curtain", metrics);
  EXPECT_THAT(text, HasSubstr("scene curtain"));
  EXPECT_THAT(text, HasSubstr("springs"));
  EXPECT_THAT(text, HasSubstr("250.000"));  // the exact maximum of the tick
  EXPECT_THAT(text, HasSubstr("125.000"));
  EXPECT_THAT(text, HasSubstr("ticks 3"));
  EXPECT_THAT(text, Not(HasSubstr("pose arrival")));
}

TEST(Log, RefusesUnknownLevels) {
  setUpLog("warning");
  EXPECT_EQ(spdlog::get_level(), spdlog::level::warn);
  setUpLog("off");
  EXPECT_EQ(spdlog::get_level(), spdlog::level::off);
  EXPECT_THROW(setUpLog("loud"), std::invalid_argument);
  setUpLog("info");
}

}  // namespace
}  // namespace clothstream::telemetry
