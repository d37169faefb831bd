// SPDX-License-Identifier: MIT
// What clients send: garbage, greetings, poses, changes.
#include <cmath>
#include <limits>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/client_message.h"
#include "server/messages/limits.h"
#include "server/messages/scene_message.h"
#include "tests/messages/scenes.h"

namespace clothstream::messages {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

std::span<const std::byte> bytesOf(const std::string& text) {
  return std::as_bytes(std::span(text));
}

TEST(ParseClientMessage, GivesTheEnvelope) {
  v1::ClientMessage message;
  message.set_request_id(7);
  message.mutable_ping()->set_client_time_us(123);
  const auto parsed = parseClientMessage(bytesOf(message.SerializeAsString()));
  ASSERT_TRUE(parsed) << parsed.error().text;
  EXPECT_EQ(parsed->request_id(), 7u);
  EXPECT_EQ(parsed->ping().client_time_us(), 123u);
}

TEST(ParseClientMessage, RefusesNothingAndAnEmptyEnvelope) {
  EXPECT_EQ(parseClientMessage({}).error().code, v1::ERROR_CODE_MALFORMED_MESSAGE);
  v1::ClientMessage message;
  message.set_request_id(7);
  EXPECT_EQ(parseClientMessage(bytesOf(message.SerializeAsString())).error().code,
            v1::ERROR_CODE_MALFORMED_MESSAGE);
}

TEST(ParseClientMessage, RefusesTooManyBytesWithTheLimit) {
  const auto parsed = parseClientMessage(bytesOf(std::string(limits::kMaxClientMessageBytes + 1, 'x')));
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.error().code, v1::ERROR_CODE_RESOURCE_EXHAUSTED);
  EXPECT_THAT(parsed.error().text, HasSubstr("at most 65536"));
}

TEST(ParseClientMessage, RefusesTruncatedMessages) {
  v1::ClientMessage message;
  message.mutable_hello()->set_scene("curtain");
  const std::string whole = message.SerializeAsString();
  for (std::size_t length = 1; length < whole.size(); ++length) {
    const auto parsed = parseClientMessage(bytesOf(whole.substr(0, length)));
    ASSERT_FALSE(parsed) << length;
    EXPECT_EQ(parsed.error().code, v1::ERROR_CODE_MALFORMED_MESSAGE);
  }
}

TEST(ParseClientMessage, SurvivesGarbage) {
  std::mt19937 random(1);
  int refused = 0;
  for (int i = 0; i < 10000; ++i) {
    std::string garbage(random() % 200, '\0');
    for (char& c : garbage) c = static_cast<char>(random());
    const auto parsed = parseClientMessage(bytesOf(garbage));
    if (!parsed) ++refused;
  }
  EXPECT_GT(refused, 9000);
}

const std::uint32_t kCodecs[] = {1, 5};

v1::Hello hello() {
  v1::Hello message;
  message.set_protocol_version(1);
  message.add_codecs(1);
  return message;
}

TEST(ToJoining, KnowsHowMuchOfTheStreamIsWanted) {
  v1::Hello message = hello();
  auto joining = toJoining(message, kCodecs);
  ASSERT_TRUE(joining);
  EXPECT_EQ(joining->quality, 0);
  EXPECT_EQ(joining->temporalLayers, 3);
  message.set_quality(3);
  message.set_temporal_layer(0);
  joining = toJoining(message, kCodecs);
  ASSERT_TRUE(joining);
  EXPECT_EQ(joining->quality, 3);
  EXPECT_EQ(joining->temporalLayers, 1);
  message.set_quality(4);
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.quality = 4: must be"));
  message.set_quality(0);
  message.set_temporal_layer(3);
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.temporalLayer = 3: must be"));
}

TEST(ToJoining, AgreesOnVersionAndTheClientsBestCodec) {
  v1::Hello message = hello();
  message.set_protocol_version(9);
  message.clear_codecs();
  for (const std::uint32_t codec : {8u, 5u, 1u}) message.add_codecs(codec);
  message.set_scene("flag");
  message.set_client_name("test 1");
  message.set_display_name("Ann");
  const auto joining = toJoining(message, kCodecs);
  ASSERT_TRUE(joining) << joining.error().text;
  EXPECT_EQ(joining->protocolVersion, kProtocolVersion);
  EXPECT_EQ(joining->codec, 5u);
  EXPECT_EQ(joining->scene, "flag");
  EXPECT_EQ(joining->clientName, "test 1");
  EXPECT_EQ(joining->displayName, "Ann");
}

TEST(ToJoining, RefusesWhatItCannotAgreeOn) {
  v1::Hello message = hello();
  message.set_protocol_version(0);
  EXPECT_EQ(toJoining(message, kCodecs).error().code, v1::ERROR_CODE_UNSUPPORTED_VERSION);
  message = hello();
  message.set_codecs(0, 77);
  const auto joining = toJoining(message, kCodecs);
  EXPECT_EQ(joining.error().code, v1::ERROR_CODE_UNSUPPORTED_CODEC);
  EXPECT_THAT(joining.error().text, HasSubstr("1, 5"));
  message.clear_codecs();
  EXPECT_EQ(toJoining(message, kCodecs).error().code, v1::ERROR_CODE_UNSUPPORTED_CODEC);
}

TEST(ToJoining, RefusesNamesThatWouldSpoilALog) {
  v1::Hello message = hello();
  message.set_client_name("a\nb");
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.clientName = \"a?b\":"));
  message = hello();
  message.set_display_name(std::string(2000, 'x'));
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.displayName"));
  message = hello();
  message.set_scene("../etc");
  EXPECT_THAT(toJoining(message, kCodecs).error().text, StartsWith("hello.scene = \"../etc\":"));
}

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

// A scene with an attachment on each of its two cloths.
scene::Scene sceneWithAttachments() {
  scene::Scene scene;
  for (const char* name : {"rod", "knot"}) {
    scene::Cloth& cloth = scene.cloths.emplace_back();
    cloth.attachments.emplace_back().name = name;
  }
  return scene;
}

Result<std::vector<scene::ParticipantCollider>> collidersOf(const v1::ColliderPoses& message) {
  return toPoses(message, sceneWithAttachments()).map([](const auto& poses) { return poses.colliders; });
}

TEST(ToPoses, GivesGrabsWithTheirDefaultsAndAttachmentsByTheirPlace) {
  v1::ColliderPoses message;
  message.add_grabs()->set_id(3);
  v1::Grab& strong = *message.add_grabs();
  strong.set_id(4);
  strong.mutable_pose()->mutable_position()->set_y(2);
  strong.set_radius(0.5f);
  strong.set_reach(0);
  strong.set_max_force(100);
  strong.set_slip_distance(1);
  message.add_attachments()->set_name("knot");
  message.mutable_attachments(0)->mutable_pose()->mutable_position()->set_x(7);
  const auto poses = toPoses(message, sceneWithAttachments());
  ASSERT_TRUE(poses) << poses.error().text;
  ASSERT_EQ(poses->grabs.size(), 2u);
  EXPECT_EQ(poses->grabs[0].id, 3u);
  EXPECT_EQ(poses->grabs[0].radius, 0.03f);
  EXPECT_EQ(poses->grabs[0].reach, 0.1f);
  EXPECT_EQ(poses->grabs[0].maxForce, 20);
  EXPECT_EQ(poses->grabs[0].slipDistance, 0.1f);
  EXPECT_EQ(poses->grabs[1].pose.position, scene::Vec3(0, 2, 0));
  EXPECT_EQ(poses->grabs[1].radius, 0.5f);
  EXPECT_EQ(poses->grabs[1].reach, 0);
  EXPECT_EQ(poses->grabs[1].maxForce, 100);
  EXPECT_EQ(poses->grabs[1].slipDistance, 1);
  ASSERT_EQ(poses->attachments.size(), 1u);
  EXPECT_EQ(poses->attachments[0].attachment, 1u);
  EXPECT_EQ(poses->attachments[0].pose.position, scene::Vec3(7, 0, 0));
}

TEST(ToPoses, RefusesWrongGrabsAndAttachmentsWithTheirPath) {
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
  EXPECT_THAT(error([](M& m) {
                for (std::uint32_t id = 3; id <= 11; ++id) m.add_grabs()->set_id(id);
              }),
              StartsWith("colliderPoses.grabs: has 11 elements; must have 0 to 10"));
  EXPECT_THAT(error([](M& m) { m.mutable_attachments(0)->set_name("rope"); }),
              StartsWith("colliderPoses.attachments[0].name = \"rope\": must be one of rod, knot"));
  EXPECT_THAT(error([](M& m) { m.mutable_attachments(0)->mutable_pose()->mutable_position()->set_x(2000); }),
              StartsWith("colliderPoses.attachments[0].pose.position.x = 2000:"));
}

TEST(ToColliders, GivesThemAll) {
  const auto colliders = collidersOf(poses(60));
  ASSERT_TRUE(colliders) << colliders.error().text;
  ASSERT_EQ(colliders->size(), 60u);
  EXPECT_EQ((*colliders)[5].id, 5u);
  EXPECT_EQ((*colliders)[5].pose.position, scene::Vec3(5, 0, 0));
  EXPECT_EQ(std::get<scene::Sphere>((*colliders)[5].shape).radius, 0.1f);
  EXPECT_TRUE(collidersOf(poses(0))->empty());
}

TEST(ToColliders, TakesCapsulesAndBoxes) {
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
  EXPECT_EQ(std::get<scene::Capsule>((*colliders)[0].shape).radius, 0.01f);
  EXPECT_EQ(std::get<scene::Capsule>((*colliders)[0].shape).length, 0.03f);
  EXPECT_EQ((*colliders)[0].pose.orientation.z(), 1);
  EXPECT_EQ(std::get<scene::Box>((*colliders)[1].shape).size, scene::Vec3(1, 2, 3));
  message.mutable_colliders(0)->mutable_capsule()->set_length(11);
  EXPECT_THAT(
      collidersOf(message).error().text,
      StartsWith("colliderPoses.colliders[0].capsule.length = 11: must be a finite number from 0 to 10"));
}

// A flat hand at z = 0 that points along +Y: fingers 2 cm apart, joints 2 cm apart, each a little thinner
// than the one before.
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

TEST(ToColliders, MakesCapsulesOfHands) {
  for (const bool palm : {true, false}) {
    v1::ColliderPoses message = poses(20);
    *message.add_hands() = hand(v1::HAND_SIDE_RIGHT, palm);
    *message.add_hands() = hand(v1::HAND_SIDE_LEFT, palm);
    const auto colliders = collidersOf(message);
    ASSERT_TRUE(colliders) << colliders.error().text;
    ASSERT_EQ(colliders->size(), 60u);
    // The first bone of the right index finger, from (-0.02, 0.02) to (-0.02, 0.04).
    const scene::ParticipantCollider& bone = (*colliders)[23];
    EXPECT_EQ(bone.id, 0x80000000u + 32 + 3);
    EXPECT_TRUE(bone.pose.position.isApprox(scene::Vec3(-0.02f, 0.03f, 0)));
    EXPECT_TRUE((bone.pose.orientation * scene::Vec3::UnitY()).isApprox(scene::Vec3::UnitY()));
    EXPECT_NEAR(std::get<scene::Capsule>(bone.shape).length, 0.02f, 1e-6f);
    EXPECT_NEAR(std::get<scene::Capsule>(bone.shape).radius, 0.0115f, 1e-6f);
    // The left one's last: from the wrist to the middle finger.
    EXPECT_EQ(colliders->back().id, 0x80000000u + 19);
    EXPECT_TRUE(colliders->back().pose.position.isApprox(scene::Vec3(0, 0.01f, 0)));
  }
}

// Whichever way a hand points, its capsules end at its joints, and do not spin about themselves as it turns.
TEST(ToColliders, HandsMayPointAnywhere) {
  scene::Quaternion before = scene::Quaternion::Identity();
  for (int degrees = 0; degrees <= 360; degrees += 5) {
    const scene::Quaternion turn(
        Eigen::AngleAxisf(static_cast<float>(degrees) * std::acos(-1.0f) / 180, scene::Vec3::UnitX()));
    v1::ColliderPoses message;
    v1::HandJoints& turned = *message.add_hands() = hand(v1::HAND_SIDE_LEFT);
    for (int joint = 0; joint < 26; ++joint) {
      const scene::Vec3 place =
          turn * scene::Vec3(turned.positions(3 * joint), turned.positions(3 * joint + 1), 0);
      for (int axis = 0; axis < 3; ++axis) turned.set_positions(3 * joint + axis, place[axis]);
    }
    const auto colliders = collidersOf(message);
    ASSERT_TRUE(colliders) << colliders.error().text;
    for (const scene::ParticipantCollider& bone : *colliders)
      EXPECT_NEAR((bone.pose.orientation * scene::Vec3::UnitY()).dot(turn * scene::Vec3::UnitY()), 1, 1e-4f);
    const scene::Quaternion now = colliders->front().pose.orientation;
    if (degrees > 0) {
      EXPECT_GT(std::abs(now.dot(before)), std::cos(3 * std::acos(-1.0f) / 180));
    }
    before = now;
  }
}

TEST(ToColliders, RefusesWhatIsNoHand) {
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
              StartsWith("colliderPoses.hands[1].id = 2147483648: is another's id already"));
  EXPECT_THAT(error([](M& m) { m.add_hands(), m.add_hands(); }),
              StartsWith("colliderPoses.hands: has 3 elements; must have 0 to 2"));
  EXPECT_THAT(error([](M& m) {
                const M more = poses(41);
                m.mutable_colliders()->MergeFrom(more.colliders());
              }),
              StartsWith("colliderPoses.colliders: has 41 elements; must have 0 to 40"));
}

TEST(ToColliders, RefusesWhatIsWrongWithItsPath) {
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

class ToParameterChange : public testing::Test {
 protected:
  std::string error() const {
    const auto change = toParameterChange(message_, scene_);
    return change ? "no error" : change.error().text;
  }

  scene::Scene scene_ = *toScene(smallScene());
  v1::ParameterChange message_;
};

TEST_F(ToParameterChange, RefusesWhatAColliderDoesNotHave) {
  v1::ColliderChange& change = *message_.add_colliders();
  change.set_name("ball");
  change.set_length(0.2f);
  EXPECT_EQ(error(), "parameterChange.colliders[0].length = 0.2: must be absent: \"ball\" is no capsule");
  change.clear_length();
  change.mutable_size()->set_x(1);
  change.mutable_size()->set_y(1);
  change.mutable_size()->set_z(1);
  EXPECT_EQ(error(), "parameterChange.colliders[0].size: must be absent: \"ball\" is no box");
  change.clear_size();
  change.set_friction(11);
  EXPECT_EQ(error(), "parameterChange.colliders[0].friction = 11: must be a finite number from 0 to 10");
}

TEST_F(ToParameterChange, TakesSizesOfTheShape) {
  scene_.colliders[0].shape = scene::Box{};
  v1::ColliderChange& change = *message_.add_colliders();
  change.set_name("ball");
  change.mutable_size()->set_x(1);
  change.mutable_size()->set_y(2);
  change.mutable_size()->set_z(3);
  change.set_friction(2);
  scene::applyChange(scene_, toParameterChange(message_, scene_).value());
  EXPECT_EQ(std::get<scene::Box>(scene_.colliders[0].shape).size, scene::Vec3(1, 2, 3));
  EXPECT_EQ(scene_.colliders[0].friction, 2);
  scene_.colliders[0].shape = scene::Capsule{};
  change.clear_size();
  change.set_length(0.7f);
  change.set_radius(0.2f);
  scene::applyChange(scene_, toParameterChange(message_, scene_).value());
  EXPECT_EQ(std::get<scene::Capsule>(scene_.colliders[0].shape).length, 0.7f);
  EXPECT_EQ(std::get<scene::Capsule>(scene_.colliders[0].shape).radius, 0.2f);
}

TEST_F(ToParameterChange, ChangesSelfCollisionAndTethersWhereTheyAre) {
  v1::ClothChange& change = *message_.add_cloths();
  change.mutable_self_collision()->set_friction(1);
  EXPECT_EQ(error(), "parameterChange.cloths[0].selfCollision: must be absent: \"" + scene_.cloths[0].name +
                         "\" has none from its start");
  change.clear_self_collision();
  change.mutable_tethers()->set_slack(0.5f);
  EXPECT_EQ(error(), "parameterChange.cloths[0].tethers: must be absent: \"" + scene_.cloths[0].name +
                         "\" has none from its start");
  scene_.cloths[0].tethers.emplace();
  scene_.cloths[0].selfCollision = scene::SelfCollision{.radius = 0.01f};
  change.mutable_self_collision()->set_friction(1);
  change.mutable_self_collision()->set_radius(10);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].selfCollision.radius = 10: must be"));
  change.mutable_self_collision()->clear_radius();
  scene::applyChange(scene_, toParameterChange(message_, scene_).value());
  EXPECT_EQ(scene_.cloths[0].selfCollision->radius, 0.01f);
  EXPECT_EQ(scene_.cloths[0].selfCollision->friction, 1);
  EXPECT_EQ(scene_.cloths[0].tethers->slack, 0.5f);
}

TEST_F(ToParameterChange, RefusesDihedralBendingThatCannotBe) {
  v1::ClothChange& change = *message_.add_cloths();
  change.set_dihedral_bending(2);
  EXPECT_EQ(error(), "parameterChange.cloths[0].dihedralBending = 2: must be a finite number from 0 to 1");
  scene_.cloths[0].structural = scene_.cloths[0].shear = scene_.cloths[0].bend = {};
  scene_.cloths[0].mass = 1e-5f;
  change.set_dihedral_bending(1);
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = "));
  change.set_dihedral_bending(1e-9f);
  EXPECT_EQ(error(), "no error");
  scene_.integrator = scene::Integrator::rungeKutta4;
  EXPECT_EQ(error(),
            "parameterChange.cloths[].dihedralBending: must be 0: other values need "
            "INTEGRATOR_SEMI_IMPLICIT_EULER");
}

TEST_F(ToParameterChange, RefusesARadiusForWhatHasNone) {
  scene_ = *toScene(sceneWithHull());
  message_.add_colliders()->set_name("ball");
  message_.mutable_colliders(0)->set_radius(0.5f);
  EXPECT_THAT(error(),
              StartsWith("parameterChange.colliders[0].radius = 0.5: must be absent: \"ball\" is neither"));
}

TEST_F(ToParameterChange, CarriesEveryField) {
  message_.mutable_gravity()->mutable_value()->set_y(-1.5f);
  message_.mutable_wind()->mutable_value()->set_z(4);
  message_.set_air_density(0.5f);
  message_.mutable_gust()->set_strength(1.5f);
  message_.mutable_gust()->set_seconds(4);
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.set_name("sheet");
  cloth.mutable_structural()->set_stiffness(11);
  cloth.mutable_shear()->set_stiffness(12);
  cloth.mutable_bend()->set_damping(0.01f);
  cloth.set_damping(0.5f);
  cloth.set_drag(0.6f);
  cloth.set_lift(0.7f);
  cloth.set_friction(0.8f);
  cloth.set_thickness(0.02f);
  cloth.mutable_solver()->mutable_acad()->set_activation(0.25f);
  cloth.mutable_solver()->mutable_acad()->mutable_constraint()->set_iterations(7);
  v1::ColliderChange& collider = *message_.add_colliders();
  collider.set_name("ball");
  collider.mutable_position()->set_x(3);
  collider.mutable_orientation()->set_y(1);
  collider.set_radius(0.5f);
  const auto change = toParameterChange(message_, scene_);
  ASSERT_TRUE(change) << change.error().text;
  applyChange(scene_, *change);
  EXPECT_EQ(scene_.environment.gravity, scene::Vec3(0, -1.5f, 0));
  EXPECT_EQ(scene_.environment.wind, scene::Vec3(0, 0, 4));
  EXPECT_EQ(scene_.environment.airDensity, 0.5f);
  EXPECT_EQ(scene_.environment.gust.strength, 1.5f);
  EXPECT_EQ(scene_.environment.gust.seconds, 4);
  EXPECT_EQ(scene_.cloths[0].structural.stiffness, 11);
  EXPECT_EQ(scene_.cloths[0].shear.stiffness, 12);
  EXPECT_EQ(scene_.cloths[0].bend.damping, 0.01f);
  EXPECT_EQ(scene_.cloths[0].damping, 0.5f);
  EXPECT_EQ(scene_.cloths[0].drag, 0.6f);
  EXPECT_EQ(scene_.cloths[0].lift, 0.7f);
  EXPECT_EQ(scene_.cloths[0].friction, 0.8f);
  EXPECT_EQ(scene_.cloths[0].thickness, 0.02f);
  EXPECT_EQ(scene_.cloths[0].solver.kind, scene::SolverKind::acad);
  EXPECT_EQ(scene_.cloths[0].solver.activation, 0.25f);
  EXPECT_EQ(scene_.cloths[0].solver.iterations, 7u);
  EXPECT_EQ(scene_.colliders[0].pose.position, scene::Vec3(3, 0, 0));
  EXPECT_EQ(scene_.colliders[0].pose.orientation.y(), 1);
  EXPECT_EQ(std::get<scene::Sphere>(scene_.colliders[0].shape).radius, 0.5f);
}

TEST_F(ToParameterChange, LeavesOutWhatIsAbsent) {
  message_.add_cloths();
  const auto change = toParameterChange(message_, scene_);
  ASSERT_TRUE(change) << change.error().text;
  EXPECT_FALSE(change->gravity || change->wind || change->airDensity);
  EXPECT_FALSE(change->cloths[0].structural || change->cloths[0].drag);
}

TEST_F(ToParameterChange, NamesWhatTheSceneHas) {
  message_.add_cloths()->set_name("rug");
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].name = \"rug\": must be one of sheet"));
  EXPECT_EQ(toParameterChange(message_, scene_).error().code, v1::ERROR_CODE_NOT_FOUND);
  message_.clear_cloths();
  message_.add_colliders();
  EXPECT_THAT(error(), StartsWith("parameterChange.colliders[0].name = \"\": must be one of ball"));
}

TEST_F(ToParameterChange, RefusesValuesWithTheirPath) {
  message_.mutable_gravity()->mutable_value()->set_x(kNan);
  EXPECT_THAT(error(), StartsWith("parameterChange.gravity.value.x = nan:"));
  message_.Clear();
  message_.set_air_density(-1);
  EXPECT_THAT(error(), StartsWith("parameterChange.airDensity = -1:"));
  message_.Clear();
  message_.add_cloths()->mutable_shear()->set_stiffness(-3);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].shear.stiffness = -3:"));
  message_.Clear();
  message_.add_colliders()->set_name("ball");
  message_.mutable_colliders(0)->mutable_position()->set_y(5000);
  EXPECT_THAT(error(), StartsWith("parameterChange.colliders[0].position.y = 5000:"));
}

TEST_F(ToParameterChange, RefusesWhatWouldMakeTheSceneUnstableNamingTheSubsteps) {
  message_.add_cloths()->mutable_structural()->set_stiffness(20000);
  // 4 springs of 20000 N/m at nodes of 0.03 kg: h < 2 / sqrt(2 * 4 * 20000 / 0.03) s = 1 / 1154.7, 16.04 a
  // tick.
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = 10, this scene needs at least 17"));
}

// Constraints set no bound on the step; going back to forces meets it again.
TEST_F(ToParameterChange, RefusesASolverThatTheSceneCannotHave) {
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.mutable_structural()->set_stiffness(20000);
  cloth.mutable_solver()->mutable_constraint();
  const auto change = toParameterChange(message_, scene_);
  ASSERT_TRUE(change) << change.error().text;
  applyChange(scene_, *change);
  message_.Clear();
  message_.add_cloths()->mutable_solver()->mutable_mass_spring();
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = 10, this scene needs at least 17"));

  message_.mutable_cloths(0)->mutable_solver()->mutable_constraint()->set_iterations(0);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].solver.constraint.iterations = 0:"));
  message_.mutable_cloths(0)->mutable_solver()->mutable_acad()->set_activation(-1);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].solver.acad.activation = -1:"));
  message_.mutable_cloths(0)->mutable_solver()->mutable_acad()->set_activation(0.1f);
  scene_.integrator = scene::Integrator::explicitEuler;
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].solver: \"sheet\" solves a system, which needs "
                                  "INTEGRATOR_SEMI_IMPLICIT_EULER"));
  message_.mutable_cloths(0)->clear_solver();
  message_.mutable_cloths(0)->set_thickness(2);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].thickness = 2:"));
}

TEST_F(ToParameterChange, MakesClothsOfAMaterial) {
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.set_material("denim");
  cloth.set_areal_mass(0.5f);
  cloth.mutable_bend()->set_stiffness(7);
  const auto change = toParameterChange(message_, scene_);
  ASSERT_TRUE(change) << change.error().text;
  applyChange(scene_, *change);
  EXPECT_EQ(scene_.cloths[0].material, "denim");
  EXPECT_EQ(scene_.cloths[0].structural.stiffness, scene::findMaterial("denim")->tension);
  EXPECT_EQ(scene_.cloths[0].bend.stiffness, 7);
  EXPECT_FLOAT_EQ(scene_.cloths[0].mass, 1.5f);
  EXPECT_EQ(scene_.cloths[0].solver.kind, scene::SolverKind::xpbd);
}

TEST_F(ToParameterChange, RefusesMaterialsThatThereAreNotAndThoseThatTheSceneCannotHave) {
  v1::ClothChange& cloth = *message_.add_cloths();
  cloth.set_material("velvet");
  EXPECT_THAT(error(),
              StartsWith("parameterChange.cloths[0].material = \"velvet\": must be one of cotton, denim, "));
  cloth.set_material("");
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].material = \"\": must be one of cotton, "));
  cloth.set_material("denim");
  scene_.integrator = scene::Integrator::explicitEuler;
  EXPECT_THAT(error(),
              StartsWith("parameterChange.cloths[0].material: \"sheet\" solves a system, which needs"));
  scene_.integrator = scene::Integrator::semiImplicitEuler;
  cloth.mutable_solver()->mutable_mass_spring();
  cloth.mutable_structural()->set_stiffness(20000);
  EXPECT_THAT(error(), StartsWith("parameterChange: with substeps = 10, this scene needs at least"));
  message_.Clear();
  message_.add_cloths()->set_areal_mass(0);
  EXPECT_THAT(error(), StartsWith("parameterChange.cloths[0].arealMass = 0:"));
  message_.Clear();
  message_.mutable_gust()->set_strength(-1);
  EXPECT_THAT(error(), StartsWith("parameterChange.gust.strength = -1:"));
  message_.mutable_gust()->set_strength(1);
  message_.mutable_gust()->set_seconds(0);
  EXPECT_THAT(error(), StartsWith("parameterChange.gust.seconds = 0:"));
}

TEST_F(ToParameterChange, JudgesAChangeAsAWhole) {
  message_.add_cloths()->mutable_structural()->set_stiffness(20000);
  message_.add_cloths()->mutable_structural()->set_stiffness(10);
  EXPECT_EQ(error(), "no error");
}

}  // namespace
}  // namespace clothstream::messages
