// SPDX-License-Identifier: MIT
// Local winds of scenes and participants: defaults, and the error for everything that is refused.
#include "server/messages/local_wind.h"

#include <functional>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/client_message.h"
#include "server/messages/scene_message.h"
#include "tests/messages/scenes.h"

namespace clothstream::messages {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

v1::LocalWind& addFan(v1::Scene& scene, const char* name = "fan") {
  v1::LocalWind& wind = *scene.mutable_environment()->add_winds();
  wind.set_name(name);
  wind.set_speed(5);
  wind.mutable_fan();
  return wind;
}

TEST(LocalWindMessages, HaveTheDefaultsOfTheProto) {
  v1::Scene message = smallScene();
  addFan(message);
  addFan(message, "whirl").mutable_vortex();
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  ASSERT_EQ(scene->winds.size(), 2u);
  EXPECT_EQ(scene->winds[0].name, "fan");
  EXPECT_EQ(scene->winds[0].speed, 5);
  const auto& fan = std::get<model::Fan>(scene->winds[0].kind);
  EXPECT_EQ(fan.radius, 0.15f);
  EXPECT_EQ(fan.spread, 0.2f);
  EXPECT_EQ(fan.range, 3);
  const auto& vortex = std::get<model::Vortex>(scene->winds[1].kind);
  EXPECT_EQ(vortex.radius, 0.3f);
  EXPECT_EQ(vortex.reach, 2);
}

TEST(LocalWindMessages, StayThroughAMessage) {
  v1::Scene message = smallScene();
  v1::LocalWind& fan = addFan(message);
  fan.mutable_pose()->mutable_position()->set_y(2);
  fan.mutable_pose()->mutable_orientation()->set_z(1);
  fan.mutable_fan()->set_radius(0.5f);
  fan.mutable_fan()->set_spread(0);
  fan.mutable_fan()->set_range(7);
  v1::Vortex& vortex = *addFan(message, "whirl").mutable_vortex();
  vortex.set_radius(0.5f);
  vortex.set_reach(6);
  const v1::Scene once = toMessage(toScene(message).value());
  EXPECT_EQ(once.environment().winds(0).SerializeAsString(), fan.SerializeAsString());
  EXPECT_EQ(once.environment().winds(1).vortex().SerializeAsString(), vortex.SerializeAsString());
  EXPECT_EQ(toMessage(toScene(once).value()).SerializeAsString(), once.SerializeAsString());
}

TEST(LocalWindMessages, AreRefusedWithPathAndRange) {
  const auto errorOf = [](const std::function<void(v1::Scene&, v1::LocalWind&)>& spoil) {
    v1::Scene message = smallScene();
    v1::LocalWind& wind = addFan(message);
    spoil(message, wind);
    const Result<model::Scene> scene = toScene(message);
    return scene ? std::string() : scene.error().text;
  };
  EXPECT_EQ(errorOf([](v1::Scene&, v1::LocalWind&) {}), "");
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.set_name("Fan"); }),
              StartsWith("environment.winds[0].name = \"Fan\":"));
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.clear_fan(); }),
              StartsWith("environment.winds[0]: has no kind"));
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.set_speed(101); }),
              StartsWith("environment.winds[0].speed = 101: must be a finite number from 0 to 100"));
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.set_speed(kNan); }),
              StartsWith("environment.winds[0].speed"));
  EXPECT_THAT(
      errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.mutable_pose()->mutable_orientation()->set_x(2); }),
      StartsWith("environment.winds[0].pose.orientation"));
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.mutable_fan()->set_radius(0); }),
              StartsWith("environment.winds[0].fan.radius = 0:"));
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.mutable_fan()->set_spread(1.5f); }),
              StartsWith("environment.winds[0].fan.spread = 1.5:"));
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.mutable_fan()->set_range(0.1f); }),
              HasSubstr("must be at least \"radius\""));
  EXPECT_THAT(errorOf([](v1::Scene&, v1::LocalWind& wind) { wind.mutable_vortex()->set_reach(2000); }),
              StartsWith("environment.winds[0].vortex.reach = 2000:"));
  EXPECT_THAT(errorOf([](v1::Scene& scene, v1::LocalWind&) { addFan(scene); }),
              HasSubstr("names must be unique"));
  EXPECT_THAT(errorOf([](v1::Scene& scene, v1::LocalWind&) {
                for (int i = 0; i < 8; ++i) addFan(scene, std::to_string(i).c_str());
              }),
              StartsWith("environment.winds"));
}

TEST(HeldWinds, AreReadAndChecked) {
  v1::ColliderPoses message;
  v1::HeldWind& held = *message.add_winds();
  held.set_id(7);
  held.mutable_wind()->set_speed(4);
  held.mutable_wind()->mutable_fan()->set_range(2);
  const auto poses = toPoses(message, {});
  ASSERT_TRUE(poses) << poses.error().text;
  ASSERT_EQ(poses->winds.size(), 1u);
  EXPECT_EQ(poses->winds[0].id, 7u);
  EXPECT_EQ(poses->winds[0].speed, 4);
  EXPECT_EQ(std::get<model::Fan>(poses->winds[0].kind).range, 2);

  held.mutable_wind()->set_name("mine");
  EXPECT_THAT(toPoses(message, {}).error().text, StartsWith("colliderPoses.winds[0].wind.name"));
  held.mutable_wind()->clear_name();
  *message.add_winds() = held;
  EXPECT_THAT(toPoses(message, {}).error().text, StartsWith("colliderPoses.winds[1].id = 7:"));
  message.mutable_winds(1)->set_id(8);
  EXPECT_TRUE(toPoses(message, {}));
  *message.add_winds() = held;
  EXPECT_THAT(toPoses(message, {}).error().text, StartsWith("colliderPoses.winds"));
}

}  // namespace
}  // namespace clothstream::messages
