// SPDX-License-Identifier: MIT
// Names of scenes, and places for scenes that are being made.
#include "server/hosting/scene_registry.h"

#include <memory>
#include <optional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/scene/live_scene.h"
#include "tests/serving/small_scene.h"

namespace clothstream::hosting {
namespace {

using testing::HasSubstr;

std::shared_ptr<scene::LiveScene> live(const std::string& name, bool created = false,
                                       const std::string& tenant = {}) {
  return std::make_shared<scene::LiveScene>(tests::smallScene(name),
                                            scene::SceneTerms{.created = created, .tenant = tenant});
}

class SceneRegistryTest : public ::testing::Test {
 protected:
  static ServerOptions limited() {
    ServerOptions options;
    options.defaultScene = "small";
    options.maxCreatedScenes = 3;
    options.maxScenesPerTenant = 2;
    return options;
  }

  std::string whyNoPlace(const std::string& name, const std::string& tenant = {}, bool isNew = true) {
    const auto place = scenes_.takePlace(name, tenant, isNew);
    return place ? "" : place.error().text();
  }

  const ServerOptions options_ = limited();
  telemetry::ServerMetrics metrics_;
  SceneRegistry scenes_{options_, metrics_, {live("other"), live("small")}};
};

TEST_F(SceneRegistryTest, EmptyNameMeansTheDefaultScene) {
  EXPECT_EQ(scenes_.find("")->name(), "small");
  EXPECT_EQ(scenes_.find("other")->name(), "other");
  EXPECT_FALSE(scenes_.find("third"));
  scenes_.erase(*scenes_.find("small"));
  EXPECT_FALSE(scenes_.find(""));
}

TEST_F(SceneRegistryTest, ListsOnlyScenesWithinReach) {
  EXPECT_THAT(scenes_.noSuchScene("third", identity::local()).text(),
              testing::EndsWith("no scene 'third'; there are other, small"));
  Identity visitor;
  visitor.scene = "other";
  EXPECT_THAT(scenes_.noSuchScene("third", visitor).text(), testing::EndsWith("'third'; there are other"));
}

TEST_F(SceneRegistryTest, PlaceHoldsNameUntilItEnds) {
  EXPECT_THAT(whyNoPlace("other"), HasSubstr("a scene 'other' exists already"));
  {
    const auto place = scenes_.takePlace("new", "", true);
    ASSERT_TRUE(place);
    EXPECT_FALSE(scenes_.find("new")) << "it cannot be joined yet";
    EXPECT_THAT(whyNoPlace("new"), HasSubstr("a scene 'new' exists already"));
  }
  EXPECT_EQ(whyNoPlace("new"), "");
}

TEST_F(SceneRegistryTest, PlaceEndsNoLaterPlace) {
  auto first = std::make_optional(scenes_.takePlace("new", "", true));
  ASSERT_TRUE(*first);
  const auto scene = live("new", true);
  scenes_.insert(scene);
  scenes_.erase(*scene);
  const auto second = scenes_.takePlace("new", "", true);
  ASSERT_TRUE(second);
  first.reset();
  EXPECT_THAT(whyNoPlace("new"), HasSubstr("exists already"));
}

TEST_F(SceneRegistryTest, PlacesCountAgainstLimits) {
  scenes_.insert(live("a", true, "red"));
  const auto second = scenes_.takePlace("b", "red", true);
  EXPECT_THAT(whyNoPlace("c", "red"), HasSubstr("your tenant has 2 created scenes"));
  const auto third = scenes_.takePlace("c", "blue", true);
  ASSERT_TRUE(second && third);
  EXPECT_THAT(whyNoPlace("d", "blue"), HasSubstr("the server has 3 created scenes"));
  scenes_.erase(*scenes_.find("a"));
  EXPECT_EQ(whyNoPlace("d", "blue"), "");
}

TEST_F(SceneRegistryTest, OnlyNewScenesAvoidOtherServers) {
  EXPECT_FALSE(scenes_.otherServerOf("far"));
  scenes_.setOtherServers([](const std::string& scene) {
    return scene == "far" ? std::optional<std::string>("b.example") : std::nullopt;
  });
  EXPECT_EQ(scenes_.otherServerOf("far"), "b.example");
  EXPECT_FALSE(scenes_.otherServerOf("near"));
  EXPECT_THAT(whyNoPlace("far"), HasSubstr("another server of the fleet has a scene 'far'"));
  EXPECT_EQ(whyNoPlace("far", "", false), "") << "it comes from there";
}

}  // namespace
}  // namespace clothstream::hosting
