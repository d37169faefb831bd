// SPDX-License-Identifier: MIT
// The table of limits and profiles.
#include "server/hosting/limits.h"

#include <set>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "server/hosting/server_options.h"
#include "server/messages/limits.h"
#include "server/scene/budget.h"

namespace clothstream::hosting {
namespace {

constexpr Profile kProfiles[] = {Profile::home, Profile::open, Profile::fleet};

TEST(LimitsTest, ProfilesHaveTheirColumns) {
  const Limits home(Profile::home), open(Profile::open), fleet(Profile::fleet);
  EXPECT_EQ(home.maxSceneNodes, 262'144u);
  EXPECT_EQ(open.maxSceneNodes, 65'536u);
  EXPECT_EQ(home.maxUploadBytes, 64'000'000u);
  EXPECT_EQ(home.helloTimeout, std::chrono::seconds(10));
  EXPECT_EQ(open.helloTimeout, std::chrono::seconds(5));
  EXPECT_TRUE(home.outsideControl);
  EXPECT_FALSE(open.outsideControl);
  EXPECT_GT(fleet.connectionsPerAddress, 100'000u);
}

TEST(LimitsTest, EachFieldHasARow) {
  const Limits limits;
  // A new field does not compile before it has a name here.
  const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u] = limits;
  const auto fields = std::tie(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u);
  EXPECT_EQ(limitTable().size(), std::tuple_size_v<decltype(fields)>);
}

TEST(LimitsTest, NoFieldHasTwoRows) {
  std::set<std::string> names;
  for (const LimitRow& row : limitTable()) {
    EXPECT_TRUE(names.insert(row.what).second) << row.what;
    for (const LimitRow& other : limitTable()) {
      EXPECT_TRUE(&row == &other || row.field != other.field) << row.what << other.what;
    }
  }
}

TEST(LimitsTest, PublicIsNeverMoreGenerousThanHome) {
  for (const LimitRow& row : limitTable()) {
    const bool isLeast = std::string(row.what).starts_with("least ");
    EXPECT_TRUE(isLeast ? row.values[1] >= row.values[0] : row.values[1] <= row.values[0]) << row.what;
  }
}

TEST(LimitsTest, ValuesFitWhatMessagesAllow) {
  for (const Profile profile : kProfiles) {
    const Limits limits(profile);
    EXPECT_LE(limits.maxNodeSprings, messages::limits::kMaxNodeSprings);
    EXPECT_LE(limits.maxSceneAttachments, messages::limits::kMaxAttachments);
    EXPECT_LE(limits.maxParsedBytes, messages::limits::kMaxParsedBytes);
    EXPECT_GT(limits.placesPerAddress, 0);
    EXPECT_LE(limits.placesPerAddress, 1);
  }
}

TEST(LimitsTest, PlacesOfAnAddressAreRoundedUp) {
  ServerOptions options;
  options.maxParticipants = 5;
  EXPECT_EQ(options.placesOfAddress(), 3u);
  options.maxParticipants = 1;
  EXPECT_EQ(options.placesOfAddress(), 1u);
  options.placesPerAddress = 1;
  EXPECT_GT(options.placesOfAddress(), kMaxParticipants) << "no limit";
}

// Servers without options have the budgets of the profile home.
TEST(LimitsTest, DefaultBudgetHasTheShareOfHome) {
  const scene::BudgetLimits budget;
  EXPECT_EQ(budget.sceneLoad, Limits().sceneShare * budget.load);
  EXPECT_EQ(budget.sceneMegabytes, Limits().sceneShare * budget.megabytes);
}

TEST(LimitsTest, ValuesHaveUnits) {
  const auto textOf = [](const char* what, Profile profile) {
    for (const LimitRow& row : limitTable())
      if (std::string(what) == row.what) return valueText(row, profile);
    return std::string("no such row");
  };
  EXPECT_EQ(textOf("memory of all uploads", Profile::open), "32 MB");
  EXPECT_EQ(textOf("memory of the uploads of one address", Profile::fleet), "none");
  EXPECT_EQ(textOf("participants of one address in a scene, as a share of --max-participants", Profile::home),
            "50 %");
  EXPECT_EQ(textOf("new connections to each port", Profile::home), "200 a second");
}

}  // namespace
}  // namespace clothstream::hosting
