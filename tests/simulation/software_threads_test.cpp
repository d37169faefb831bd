// SPDX-License-Identifier: MIT
// Threads of software devices for a scene.
#include "server/simulation/software_threads.h"

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace clothstream::simulation {
namespace {

constexpr const char* kVariable = "LP_NUM_THREADS";

TEST(SoftwareThreads, AreZeroForFewNodesUnlessConfigured) {
  const char* given = std::getenv(kVariable);
  const std::string before = given != nullptr ? given : "";
  unsetenv(kVariable);
  EXPECT_EQ(suitedTo(kFewNodes, {}).softwareThreads, 0u);
  EXPECT_EQ(suitedTo(kFewNodes + 1, {}).softwareThreads, std::nullopt);
  EXPECT_EQ(suitedTo(1, {.softwareThreads = 3}).softwareThreads, 3u);
  setenv(kVariable, "2", 1);
  EXPECT_EQ(suitedTo(1, {}).softwareThreads, std::nullopt);
  if (given != nullptr)
    setenv(kVariable, before.c_str(), 1);
  else
    unsetenv(kVariable);
}

}  // namespace
}  // namespace clothstream::simulation
