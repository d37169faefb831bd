// SPDX-License-Identifier: MIT
// Poses of clients: colliders, hands, grabs and attachments.
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/client_message.h"
#include "server/messages/scene_file.h"
#include "tests/messages/scenes.h"

namespace clothstream::messages {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

v1::ColliderPoses poses(std::uint32_t count) {
  v1::ColliderPoses message;
  for (std::uint32_t id = 0; id < count; ++id) {
    v1::ParticipantCollider& collider = *message.add_colliders();
    collider.set_id(id);
    collider.mutable_sphere()->set_radius(0.1f);
    collider.mutable_pose()->mutable_position()->set_x(static_cast<float>(id));
  }
  return message;
}

// Scene with two cloths and one attachment on each.
model::Scene sceneWithAttachments() {
  model::Scene scene;
  for (const char* name : {"rod", "knot"}) {
    model::Cloth& cloth = scene.cloths.emplace_back();
    cloth.attachments.emplace_back().name = name;
  }
  return scene;
}

Result<std::vector<model::ParticipantCollider>> collidersOf(const v1::ColliderPoses& message) {
  return toPoses(message, sceneWithAttachments()).map([](const auto& poses) { return poses.colliders; });
}

// The stream holds 514.2 m. Cloth that hangs from an attachment needs room, too.
TEST(ToPoses, RefusesAttachmentsBeyondHalfOfTheRangeOfTheStream) {
  v1::ColliderPoses message;
  message.add_attachments()->set_name("knot");
  v1::Vec3& position = *message.mutable_attachments(0)->mutable_pose()->mutable_position();
  position.set_y(-257);
  EXPECT_TRUE(toPoses(message, sceneWithAttachments()));
  position.set_y(-258);
  const auto poses = toPoses(message, sceneWithAttachments());
  ASSERT_FALSE(poses);
  EXPECT_THAT(poses.error().text, HasSubstr("attachments[0].pose = -258: must be a finite number from -257"));
}

// The dress of this scene follows the joints of "avatar", and would take the scene back for everyone if it
// left the 514.2 m of the stream. Nothing follows "floor".
TEST(ToPoses, PlaceAndJointsKeepClothInTheRangeOfTheStream) {
  const model::Scene scene = *loadScene("dress");
  const auto stands = [&](float x) {
    v1::WearBody message;
    message.set_collider("avatar");
    message.mutable_stands()->mutable_position()->set_x(x);
    const auto worn = toWornBody(message, scene);
    return worn ? "no error" : worn.error().text;
  };
  EXPECT_EQ(stands(257), "no error");
  EXPECT_THAT(stands(258), StartsWith("wearBody.stands = 258: must be a finite number from -257"));
  EXPECT_THAT(stands(kNan), StartsWith("wearBody.stands.position.x = nan:"));
  const auto moved = [&](const char* collider, float x) {
    v1::ParameterChange message;
    v1::ColliderChange& change = *message.add_colliders();
    change.set_name(collider);
    change.mutable_position()->set_x(x);
    const auto changed = toParameterChange(message, scene, model::StabilityBound(scene));
    return changed ? "no error" : changed.error().text;
  };
  EXPECT_EQ(moved("avatar", -257), "no error");
  EXPECT_THAT(moved("avatar", -258),
              StartsWith("parameterChange.colliders[0].position = -258: must be a finite number from -257"));
  EXPECT_EQ(moved("floor", 900), "no error");
  const auto joints = [&](float x) {
    v1::ColliderPoses message;
    v1::ColliderJoints& poses = *message.add_joints();
    poses.set_collider("avatar");
    for (int i = 0; i < 17; ++i) poses.add_joints();
    poses.mutable_joints(0)->mutable_position()->set_x(x);
    const auto read = toPoses(message, scene);
    return read ? "no error" : read.error().text;
  };
  // The dress is 1 m high, and 1 m wide.
  EXPECT_EQ(joints(250), "no error");
  EXPECT_THAT(joints(257), HasSubstr("joints: take the cloth \"dress\" up to 25"));
  EXPECT_THAT(joints(kNan), StartsWith("colliderPoses.joints[0].joints[0].position.x = nan:"));
}

TEST(ToPoses, ReturnsGrabsWithDefaultsAndAttachmentsByIndex) {
  v1::ColliderPoses message;
  v1::Grab& placed = *message.add_grabs();
  placed.set_id(3);
  placed.mutable_place()->set_cloth(1);
  placed.mutable_place()->set_triangle(1);
  placed.mutable_place()->set_second(0.25f);
  placed.mutable_place()->set_seen_tick(70);
  v1::Grab& strong = *message.add_grabs();
  strong.set_id(4);
  strong.mutable_pose()->mutable_position()->set_y(2);
  strong.set_radius(0.5f);
  strong.set_reach(0);
  strong.set_max_force(100);
  strong.set_slip_distance(1);
  message.add_attachments()->set_name("knot");
  message.mutable_attachments(0)->mutable_pose()->mutable_position()->set_x(7);
  message.mutable_attachments(0)->set_jumps(true);
  const auto poses = toPoses(message, sceneWithAttachments());
  ASSERT_TRUE(poses) << poses.error().text;
  ASSERT_EQ(poses->grabs.size(), 2u);
  EXPECT_EQ(poses->grabs[0].id, 3u);
  EXPECT_EQ(poses->grabs[0].radius, 0.03f);
  EXPECT_EQ(poses->grabs[0].reach, 0.1f);
  EXPECT_EQ(poses->grabs[0].maxForce, 20);
  EXPECT_EQ(poses->grabs[0].slipDistance, 0.1f);
  ASSERT_TRUE(poses->grabs[0].place.has_value());
  EXPECT_EQ(poses->grabs[0].place->point.cloth, 1u);
  EXPECT_EQ(poses->grabs[0].place->point.triangle, 1u);
  EXPECT_EQ(poses->grabs[0].place->point.second, 0.25f);
  EXPECT_EQ(poses->grabs[0].place->seenTick, 70u);
  EXPECT_FALSE(poses->grabs[1].place.has_value());
  EXPECT_EQ(poses->grabs[1].pose.position, model::Vec3(0, 2, 0));
  EXPECT_EQ(poses->grabs[1].radius, 0.5f);
  EXPECT_EQ(poses->grabs[1].reach, 0);
  EXPECT_EQ(poses->grabs[1].maxForce, 100);
  EXPECT_EQ(poses->grabs[1].slipDistance, 1);
  ASSERT_EQ(poses->attachments.size(), 1u);
  EXPECT_EQ(poses->attachments[0].attachment, 1u);
  EXPECT_EQ(poses->attachments[0].pose.position, model::Vec3(7, 0, 0));
  EXPECT_TRUE(poses->attachments[0].jumps);
}

TEST(ToPoses, RefusesInvalidGrabsAndAttachmentsWithTheirPath) {
  const auto error = [](auto spoil) {
    v1::ColliderPoses message;
    message.add_grabs()->set_id(1);
    message.add_grabs()->set_id(2);
    message.add_attachments()->set_name("rod");
    spoil(message);
    const auto poses = toPoses(message, sceneWithAttachments());
    return poses ? "no error" : poses.error().text;
  };
  using M = v1::ColliderPoses;
  EXPECT_EQ(error([](M&) {}), "no error");
  EXPECT_THAT(error([](M& m) { m.mutable_grabs(1)->set_id(1); }),
              StartsWith("colliderPoses.grabs[1].id = 1:"));
  EXPECT_THAT(error([](M& m) { m.mutable_grabs(0)->set_radius(0); }),
              StartsWith("colliderPoses.grabs[0].radius = 0: must be a finite number from 0.001 to 1"));
  EXPECT_THAT(error([](M& m) { m.mutable_grabs(0)->set_reach(2); }),
              StartsWith("colliderPoses.grabs[0].reach = 2:"));
  EXPECT_THAT(error([](M& m) { m.mutable_grabs(0)->set_max_force(kNan); }),
              StartsWith("colliderPoses.grabs[0].maxForce = nan:"));
  EXPECT_THAT(error([](M& m) { m.mutable_grabs(0)->set_slip_distance(-1); }),
              StartsWith("colliderPoses.grabs[0].slipDistance = -1:"));
  const auto placeError = [&](auto spoil) {
    return error([&](M& m) { spoil(*m.mutable_grabs(1)->mutable_place()); });
  };
  using P = v1::GrabPlace;
  EXPECT_EQ(placeError([](P&) {}), "no error");
  EXPECT_THAT(placeError([](P& p) { p.set_cloth(2); }),
              StartsWith("colliderPoses.grabs[1].place.cloth = 2: must be"));
  EXPECT_THAT(placeError([](P& p) { p.set_triangle(1u << 31); }),
              StartsWith("colliderPoses.grabs[1].place.triangle = 2147483648: must be"));
  EXPECT_THAT(placeError([](P& p) { p.set_second(kNan); }),
              StartsWith("colliderPoses.grabs[1].place.second = nan:"));
  EXPECT_THAT(placeError([](P& p) { p.set_third(-0.1f); }),
              StartsWith("colliderPoses.grabs[1].place.third = -0.1:"));
  EXPECT_THAT(placeError([](P& p) {
                p.set_second(0.6f);
                p.set_third(0.6f);
              }),
              StartsWith("colliderPoses.grabs[1].place = second + third = 1.2: must be at most 1"));
  EXPECT_THAT(error([](M& m) {
                for (std::uint32_t id = 3; id <= 11; ++id) m.add_grabs()->set_id(id);
              }),
              StartsWith("colliderPoses.grabs: has 11 elements; must have 0 to 10"));
  EXPECT_THAT(error([](M& m) { m.mutable_attachments(0)->set_name("rope"); }),
              StartsWith("colliderPoses.attachments[0].name = \"rope\": must be one of rod, knot"));
  EXPECT_THAT(error([](M& m) { m.mutable_attachments(0)->mutable_pose()->mutable_position()->set_x(2000); }),
              StartsWith("colliderPoses.attachments[0].pose.position.x = 2000:"));
}

TEST(ToColliders, ReturnsEveryCollider) {
  const auto colliders = collidersOf(poses(60));
  ASSERT_TRUE(colliders) << colliders.error().text;
  ASSERT_EQ(colliders->size(), 60u);
  EXPECT_EQ((*colliders)[5].id, 5u);
  EXPECT_EQ((*colliders)[5].pose.position, model::Vec3(5, 0, 0));
  EXPECT_EQ(std::get<model::Sphere>((*colliders)[5].shape).radius, 0.1f);
  EXPECT_TRUE(collidersOf(poses(0))->empty());
}

TEST(ToColliders, AcceptsCapsulesAndBoxes) {
  v1::ColliderPoses message = poses(2);
  message.mutable_colliders(0)->mutable_capsule()->set_radius(0.01f);
  message.mutable_colliders(0)->mutable_capsule()->set_length(0.03f);
  message.mutable_colliders(0)->mutable_pose()->mutable_orientation()->set_z(1);
  message.mutable_colliders(1)->mutable_box()->mutable_size()->set_x(1);
  message.mutable_colliders(1)->mutable_box()->mutable_size()->set_y(2);
  EXPECT_THAT(collidersOf(message).error().text, StartsWith("colliderPoses.colliders[1].box.size.z = 0:"));
  message.mutable_colliders(1)->mutable_box()->mutable_size()->set_z(3);
  const auto colliders = collidersOf(message);
  ASSERT_TRUE(colliders) << colliders.error().text;
  EXPECT_EQ(std::get<model::Capsule>((*colliders)[0].shape).radius, 0.01f);
  EXPECT_EQ(std::get<model::Capsule>((*colliders)[0].shape).length, 0.03f);
  EXPECT_FALSE(std::get<model::Capsule>((*colliders)[0].shape).topRadius);
  EXPECT_EQ((*colliders)[0].pose.orientation.z(), 1);
  EXPECT_EQ(std::get<model::Box>((*colliders)[1].shape).size, model::Vec3(1, 2, 3));
  message.mutable_colliders(0)->mutable_capsule()->set_length(11);
  EXPECT_THAT(
      collidersOf(message).error().text,
      StartsWith("colliderPoses.colliders[0].capsule.length = 11: must be a finite number from 0 to 10"));
}

// Flat hand at z = 0 that points along +Y. Fingers are 2 cm apart, joints 2 cm. Each joint is slightly
// thinner than the previous one.
v1::HandJoints hand(v1::HandSide side, bool palm = true) {
  v1::HandJoints message;
  message.set_side(side);
  const auto add = [&](float x, float y, float radius) {
    for (const float part : {x, y, 0.0f}) message.add_positions(part);
    message.add_radii(radius);
  };
  if (palm) add(0, 0.04f, 0.02f);
  add(0, 0, 0.015f);
  for (int finger = 0; finger < 5; ++finger) {
    const int joints = finger == 0 ? 4 : 5;
    for (int joint = 0; joint < joints; ++joint)
      add(0.02f * static_cast<float>(finger - 2), 0.02f * static_cast<float>(joint + 1),
          0.012f - 0.001f * static_cast<float>(joint));
  }
  return message;
}

TEST(ToColliders, ConvertsHandsToCapsules) {
  for (const bool palm : {true, false}) {
    v1::ColliderPoses message = poses(20);
    *message.add_hands() = hand(v1::HAND_SIDE_RIGHT, palm);
    *message.add_hands() = hand(v1::HAND_SIDE_LEFT, palm);
    const auto colliders = collidersOf(message);
    ASSERT_TRUE(colliders) << colliders.error().text;
    ASSERT_EQ(colliders->size(), 60u);
    // First bone of the right index finger, from (-0.02, 0.02) to (-0.02, 0.04).
    const model::ParticipantCollider& bone = (*colliders)[23];
    EXPECT_EQ(bone.id, 0x80000000u + 32 + 3);
    EXPECT_TRUE(bone.pose.position.isApprox(model::Vec3(-0.02f, 0.03f, 0)));
    EXPECT_TRUE((bone.pose.orientation * model::Vec3::UnitY()).isApprox(model::Vec3::UnitY()));
    EXPECT_NEAR(std::get<model::Capsule>(bone.shape).length, 0.02f, 1e-6f);
    EXPECT_NEAR(std::get<model::Capsule>(bone.shape).radius, 0.0115f, 1e-6f);
    // Last bone of the left hand, from the wrist to the middle finger.
    EXPECT_EQ(colliders->back().id, 0x80000000u + 19);
    EXPECT_TRUE(colliders->back().pose.position.isApprox(model::Vec3(0, 0.01f, 0)));
  }
}

// Capsules end at the joints for every direction of the hand, and do not spin around their axes when it
// turns.
TEST(ToColliders, FollowsHandsInEveryDirection) {
  model::Quaternion before = model::Quaternion::Identity();
  for (int degrees = 0; degrees <= 360; degrees += 5) {
    const model::Quaternion turn(
        Eigen::AngleAxisf(static_cast<float>(degrees) * std::acos(-1.0f) / 180, model::Vec3::UnitX()));
    v1::ColliderPoses message;
    v1::HandJoints& turned = *message.add_hands() = hand(v1::HAND_SIDE_LEFT);
    for (int joint = 0; joint < 26; ++joint) {
      const model::Vec3 place =
          turn * model::Vec3(turned.positions(3 * joint), turned.positions(3 * joint + 1), 0);
      for (int axis = 0; axis < 3; ++axis) turned.set_positions(3 * joint + axis, place[axis]);
    }
    const auto colliders = collidersOf(message);
    ASSERT_TRUE(colliders) << colliders.error().text;
    for (const model::ParticipantCollider& bone : *colliders)
      EXPECT_NEAR((bone.pose.orientation * model::Vec3::UnitY()).dot(turn * model::Vec3::UnitY()), 1, 1e-4f);
    const model::Quaternion now = colliders->front().pose.orientation;
    if (degrees > 0) {
      EXPECT_GT(std::abs(now.dot(before)), std::cos(3 * std::acos(-1.0f) / 180));
    }
    before = now;
  }
}

TEST(ToColliders, RefusesInvalidHands) {
  const auto error = [](auto spoil) {
    v1::ColliderPoses message;
    *message.add_hands() = hand(v1::HAND_SIDE_LEFT);
    spoil(message);
    const auto colliders = collidersOf(message);
    return colliders ? "no error" : colliders.error().text;
  };
  using M = v1::ColliderPoses;
  EXPECT_EQ(error([](M&) {}), "no error");
  EXPECT_THAT(error([](M& m) { m.mutable_hands(0)->set_side(v1::HAND_SIDE_UNSPECIFIED); }),
              StartsWith("colliderPoses.hands[0].side = 0: must be HAND_SIDE_LEFT or HAND_SIDE_RIGHT"));
  EXPECT_THAT(error([](M& m) { m.mutable_hands(0)->add_radii(0.01f); }),
              StartsWith("colliderPoses.hands[0].radii: has 27 elements; must have 26"));
  EXPECT_THAT(error([](M& m) { m.mutable_hands(0)->add_positions(0); }),
              StartsWith("colliderPoses.hands[0].positions: has 79 elements; must have 78 to 78"));
  EXPECT_THAT(error([](M& m) { m.mutable_hands(0)->set_positions(4, kNan); }),
              StartsWith("colliderPoses.hands[0].positions[4] = nan:"));
  EXPECT_THAT(error([](M& m) { m.mutable_hands(0)->set_radii(3, 0.2f); }),
              StartsWith("colliderPoses.hands[0].radii[3] = 0.2: must be a finite number from 0.001 to 0.1"));
  EXPECT_THAT(error([](M& m) { m.mutable_hands(0)->set_positions(3 * 10, 1); }),
              StartsWith("colliderPoses.hands[0].positions[30]: the joint is"));
  EXPECT_THAT(error([](M& m) { *m.add_hands() = m.hands(0); }),
              StartsWith("colliderPoses.hands[1].id = 2147483648: is used twice"));
  EXPECT_THAT(error([](M& m) { m.add_hands(), m.add_hands(); }),
              StartsWith("colliderPoses.hands: has 3 elements; must have 0 to 2"));
  EXPECT_THAT(error([](M& m) {
                const M more = poses(41);
                m.mutable_colliders()->MergeFrom(more.colliders());
              }),
              StartsWith("colliderPoses.colliders: has 41 elements; must have 0 to 40"));
}

TEST(ToColliders, RefusesInvalidCollidersWithTheirPath) {
  const auto error = [](auto spoil) {
    v1::ColliderPoses message = poses(3);
    spoil(message);
    const auto colliders = collidersOf(message);
    return colliders ? "no error" : colliders.error().text;
  };
  using M = v1::ColliderPoses;
  EXPECT_THAT(error([](M& m) { m = poses(61); }),
              StartsWith("colliderPoses.colliders: has 61 elements; must have 0 to 60"));
  EXPECT_THAT(error([](M& m) { m.mutable_colliders(1)->mutable_pose()->mutable_position()->set_y(kNan); }),
              StartsWith("colliderPoses.colliders[1].pose.position.y = nan:"));
  EXPECT_THAT(error([](M& m) { m.mutable_colliders(2)->mutable_pose()->mutable_position()->set_z(1000.5f); }),
              StartsWith("colliderPoses.colliders[2].pose.position.z = 1000.5:"));
  EXPECT_THAT(error([](M& m) { m.mutable_colliders(2)->mutable_pose()->mutable_orientation()->set_x(2); }),
              StartsWith("colliderPoses.colliders[2].pose.orientation = (2, 0, 0, 0):"));
  EXPECT_THAT(
      error([](M& m) { m.mutable_colliders(0)->mutable_sphere()->set_radius(10.5f); }),
      StartsWith(
          "colliderPoses.colliders[0].sphere.radius = 10.5: must be a finite number from 0.001 to 10"));
  EXPECT_THAT(error([](M& m) { m.mutable_colliders(0)->mutable_sphere()->set_radius(0); }),
              StartsWith("colliderPoses.colliders[0].sphere.radius = 0:"));
  EXPECT_THAT(error([](M& m) { m.mutable_colliders(0)->clear_sphere(); }),
              StartsWith("colliderPoses.colliders[0]: has no shape"));
  EXPECT_THAT(error([](M& m) { m.mutable_colliders(2)->set_id(1); }),
              StartsWith("colliderPoses.colliders[2].id = 1:"));
}

}  // namespace
}  // namespace clothstream::messages
