// SPDX-License-Identifier: MIT
// What a scene gives up after ticks whose states are not valid.
#include "server/scene/recovery_policy.h"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace clothstream::scene {
namespace {

using Cure = RecoveryPolicy::Cure;

constexpr std::uint32_t kSecond = 40;  // ticks

TEST(RecoveryPolicy, GoesBackASecondAndThenToTheStart) {
  RecoveryPolicy policy(kSecond);
  EXPECT_EQ(policy.invalid(100, false), Cure::rollback);
  EXPECT_EQ(policy.invalid(101, false), Cure::reset);
  EXPECT_EQ(policy.invalid(141, false), Cure::reset);
  EXPECT_EQ(policy.invalid(182, false), Cure::rollback);
}

TEST(RecoveryPolicy, LetsGoOfParticipantsBeforeItUndoesAChange) {
  RecoveryPolicy policy(kSecond);
  policy.changed(99);
  EXPECT_EQ(policy.invalid(100, true), Cure::rollback);
  EXPECT_FALSE(policy.ignores(100));
  EXPECT_EQ(policy.invalid(101, true), Cure::resetAndLetGo);
  EXPECT_TRUE(policy.ignores(101));
  EXPECT_TRUE(policy.ignores(140));
  EXPECT_FALSE(policy.ignores(141));
  EXPECT_EQ(policy.invalid(102, true), Cure::resetAndUndo);
  EXPECT_EQ(policy.invalid(103, true), Cure::reset);
}

// Ten divergences in seven seconds, all by hands, cost the owner no parameter.
TEST(RecoveryPolicy, NeverUndoesParametersThatASecondHasProven) {
  RecoveryPolicy policy(kSecond);
  policy.changed(9);
  EXPECT_FALSE(policy.valid(10));
  EXPECT_FALSE(policy.valid(48));
  EXPECT_TRUE(policy.valid(49));
  EXPECT_FALSE(policy.valid(50));
  for (std::uint64_t tick = 51; tick < 51 + 7 * kSecond; tick += 28)
    EXPECT_NE(policy.invalid(tick, true), Cure::resetAndUndo) << tick;
}

TEST(RecoveryPolicy, AnInvalidStateStartsTheProofAgain) {
  RecoveryPolicy policy(kSecond);
  policy.changed(10);
  EXPECT_EQ(policy.invalid(30, false), Cure::rollback);
  EXPECT_FALSE(policy.valid(69));
  EXPECT_TRUE(policy.valid(70));
}

// A slider that changes the parameters twice a second for three seconds.
TEST(RecoveryPolicy, ProvesParametersWhileTheyChangeAllTheTime) {
  RecoveryPolicy policy(kSecond);
  std::vector<std::uint64_t> proven;
  for (std::uint64_t tick = 1; tick <= 3 * kSecond; ++tick) {
    if (tick % (kSecond / 2) == 1) policy.changed(tick - 1);
    if (policy.valid(tick)) proven.push_back(tick);
  }
  EXPECT_EQ(proven, (std::vector<std::uint64_t>{kSecond, 2 * kSecond, 3 * kSecond}));
  EXPECT_TRUE(policy.hasCandidate()) << "the newest parameters";
  EXPECT_TRUE(policy.valid(4 * kSecond));
  EXPECT_FALSE(policy.hasCandidate());
}

TEST(RecoveryPolicy, UndoneChangesLeaveNoCandidate) {
  RecoveryPolicy policy(kSecond);
  policy.changed(90);
  policy.changed(95);
  EXPECT_EQ(policy.invalid(100, false), Cure::rollback);
  EXPECT_EQ(policy.invalid(101, false), Cure::resetAndUndo);
  EXPECT_FALSE(policy.hasCandidate());
  EXPECT_FALSE(policy.valid(141));
  policy.changed(150);
  EXPECT_TRUE(policy.valid(190));
  EXPECT_FALSE(policy.hasCandidate());
}

TEST(RecoveryPolicy, ContinuesFromACheckpoint) {
  RecoveryPolicy policy(kSecond);
  policy.restore(100);
  EXPECT_EQ(policy.newest(), 100u);
  EXPECT_EQ(policy.invalid(120, false), Cure::reset);
}

}  // namespace
}  // namespace clothstream::scene
