// SPDX-License-Identifier: MIT
// Roles of participants, and the actions that require them.
#include "server/scene/roles.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "clothstream/v1/session.pb.h"

namespace clothstream::scene {
namespace {

using ::testing::HasSubstr;

struct ActionCase {
  Action action;
  Role needed;      // if participants may change all parameters
  Role restricted;  // if participants may change none
};

TEST(Roles, EachActionRequiresItsRole) {
  const ActionCase cases[] = {
      {Action::collide, Role::participant, Role::participant},
      {Action::grab, Role::participant, Role::participant},
      {Action::moveAttachments, Role::participant, Role::participant},
      {Action::holdWinds, Role::participant, Role::owner},
      {Action::changeEnvironment, Role::participant, Role::owner},
      {Action::changeCloths, Role::participant, Role::owner},
      {Action::changeColliders, Role::participant, Role::owner},
      {Action::controlScene, Role::owner, Role::owner},
      {Action::deleteScene, Role::owner, Role::owner},
      {Action::recordScene, Role::owner, Role::owner},
      {Action::setRole, Role::owner, Role::owner},
      {Action::removeParticipant, Role::owner, Role::owner},
  };
  for (const ActionCase& tried : cases)
    for (const bool may : {true, false})
      for (const Role role : {Role::viewer, Role::participant, Role::owner}) {
        const Role needed = may ? tried.needed : tried.restricted;
        const auto permitted = permit(role, tried.action, {may, may, may});
        EXPECT_EQ(permitted.has_value(), role >= needed) << static_cast<int>(tried.action) << nameOf(role);
        if (permitted) continue;
        EXPECT_EQ(permitted.error().code, v1::ERROR_CODE_PERMISSION_DENIED);
        EXPECT_THAT(permitted.error().text, HasSubstr(fmt::format("requires the role {}; yours is {}",
                                                                  nameOf(needed), nameOf(role))));
      }
}

TEST(Roles, ChangeRequiresTheRoleOfItsContent) {
  const auto parts = [](const v1::ParameterChange& change, const Permissions& permissions) {
    return permit(Role::participant, change, permissions).has_value();
  };
  v1::ParameterChange wind, gust, cloth, ball, both;
  wind.mutable_wind();
  gust.mutable_gust();
  cloth.add_cloths();
  ball.add_colliders();
  both.add_cloths();
  both.mutable_gravity();
  for (const v1::ParameterChange* change : {&wind, &gust}) {
    EXPECT_TRUE(parts(*change, {true, false, false}));
    EXPECT_FALSE(parts(*change, {false, true, true}));
  }
  EXPECT_TRUE(parts(cloth, {false, true, false}));
  EXPECT_FALSE(parts(cloth, {true, false, true}));
  EXPECT_TRUE(parts(ball, {false, false, true}));
  EXPECT_FALSE(parts(ball, {true, true, false}));
  EXPECT_FALSE(parts(both, {true, false, true}));
  EXPECT_FALSE(parts(both, {false, true, true}));
  EXPECT_FALSE(permit(Role::viewer, v1::ParameterChange(), Permissions()).has_value());
}

TEST(Roles, ViewerMayRequestContactEvents) {
  v1::ColliderPoses wish, hand, grab, knot, fan;
  wish.set_contact_events(true);
  hand.add_colliders();
  grab.add_grabs();
  knot.add_attachments();
  fan.add_winds();
  EXPECT_TRUE(permit(Role::viewer, wish, {}).has_value());
  for (const v1::ColliderPoses* act : {&hand, &grab, &knot, &fan}) {
    EXPECT_FALSE(permit(Role::viewer, *act, {}).has_value());
    EXPECT_TRUE(permit(Role::participant, *act, {}).has_value());
  }
}

}  // namespace
}  // namespace clothstream::scene
