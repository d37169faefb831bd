// SPDX-License-Identifier: MIT
// Colliders that are meshes, and their joints, in messages.
#include "server/messages/solid_message.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/client_message.h"
#include "server/messages/description.h"
#include "server/messages/scene_message.h"
#include "tests/meshes/skinned_glb.h"
#include "tests/messages/scenes.h"

namespace clothstream::messages {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

// smallScene() with a tetrahedron of two joints as the collider.
v1::Scene sceneWithMesh() {
  v1::Scene scene = smallScene();
  v1::ColliderMesh& mesh = *scene.mutable_colliders(0)->mutable_mesh();
  for (const float number : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f})
    mesh.add_positions(number);
  for (const std::uint32_t corner : {0u, 2u, 1u, 0u, 1u, 3u, 0u, 3u, 2u, 1u, 2u, 3u})
    mesh.add_triangles(corner);
  v1::Skin& skin = *mesh.mutable_skin();
  skin.add_joints()->set_name("root");
  v1::Joint& tip = *skin.add_joints();
  tip.set_parent(0);
  tip.mutable_rest()->mutable_position()->set_z(0.5f);
  for (int i = 0; i < 4; ++i)
    for (const float weight : {0.75f, 0.25f, 0.0f, 0.0f}) {
      skin.add_vertex_joints(weight == 0.25f ? 1 : 0);
      skin.add_vertex_weights(weight);
    }
  for (const float time : {0.0f, 2.0f}) {
    v1::JointKey& key = *skin.mutable_animation()->add_keys();
    key.set_time(time);
    key.add_joints()->mutable_position()->set_y(time);
    *key.add_joints() = tip.rest();
  }
  return scene;
}

const model::ClosedMesh& meshOf(const model::Scene& scene) {
  return *std::get<model::Solid>(scene.colliders[0].shape);
}

TEST(SolidMessage, KeepsMeshAndJointsThroughAMessage) {
  const Result<model::Scene> scene = toScene(sceneWithMesh());
  ASSERT_TRUE(scene) << scene.error().text;
  const v1::Scene message = toMessage(*scene);
  const Result<model::Scene> again = toScene(message);
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(toMessage(*again).SerializeAsString(), message.SerializeAsString());
  EXPECT_EQ(meshOf(*again).vertices, meshOf(*scene).vertices);
  EXPECT_EQ(meshOf(*again).skin->joints.size(), 2u);
  EXPECT_EQ(meshOf(*again).skin->keys[1].joints[0].position.y(), 2);
}

TEST(SolidMessage, DescriptionsHaveTheMeshOnce) {
  const model::Scene scene = *toScene(sceneWithMesh());
  const v1::StreamDescription description = toDescription(scene, 1, 2, 0);
  EXPECT_EQ(description.colliders(0).mesh().positions().size(), 4u * 12);
  EXPECT_EQ(description.colliders(0).mesh().triangles().size(), 4u * 12);
  EXPECT_EQ(description.colliders(0).mesh().joints().size(), 16u);
  EXPECT_EQ(description.colliders(0).mesh().weights().size(), 64u);
  EXPECT_EQ(description.colliders(0).mesh().rest_size(), 14);
  EXPECT_EQ(description.definition().colliders(0).mesh().positions_size(), 0);
}

std::string errorOf(const std::function<void(v1::Scene&, v1::ColliderMesh&)>& spoil) {
  v1::Scene scene = sceneWithMesh();
  spoil(scene, *scene.mutable_colliders(0)->mutable_mesh());
  const Result<model::Scene> made = toScene(scene);
  return made ? "no error" : made.error().text;
}

TEST(SolidMessage, RefusesWrongMeshesWithTheFieldAndTheReason) {
  using S = v1::Scene;
  using M = v1::ColliderMesh;
  EXPECT_EQ(errorOf([](S&, M&) {}), "no error");
  EXPECT_THAT(errorOf([](S&, M& m) { m.add_positions(1); }),
              StartsWith("colliders[0].mesh.positions: has 13"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.set_positions(4, 2000); }),
              StartsWith("colliders[0].mesh.positions[4] = 2000:"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.set_triangles(0, 4); }),
              StartsWith("colliders[0].mesh: triangle 0 has the corner 4"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_triangles()->Truncate(9); }),
              StartsWith("colliders[0].mesh.triangles: has 3 elements; must have 4 to 20000"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.set_file("a.obj"); }), StartsWith("colliders[0].mesh.file"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.set_scale(0); }), StartsWith("colliders[0].mesh.scale = 0:"));
  EXPECT_THAT(errorOf([](S& s, M&) {
                for (int i = 1; i < 9; ++i) {
                  *s.add_colliders() = s.colliders(0);
                  s.mutable_colliders(i)->set_name("mesh" + std::to_string(i));
                }
              }),
              StartsWith("colliders: have 9 meshes; must have at most 8"));
}

TEST(SolidMessage, KeepsTheCellOfSampledDistances) {
  v1::Scene message = sceneWithMesh();
  message.mutable_colliders(0)->mutable_mesh()->clear_skin();
  message.mutable_colliders(0)->mutable_mesh()->set_distance_cell(0.05f);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_EQ(meshOf(*scene).distanceCell, 0.05f);
  EXPECT_EQ(meshOf(*toScene(toMessage(*scene))).distanceCell, 0.05f);
}

TEST(SolidMessage, RefusesSampledDistancesThatMeanNothingOrCostTooMuch) {
  using S = v1::Scene;
  using M = v1::ColliderMesh;
  EXPECT_THAT(errorOf([](S&, M& m) { m.set_distance_cell(0.05f); }),
              StartsWith("colliders[0].mesh.distanceCell = 0.05: is for rigid meshes"));
  const auto rigid = [](float cell) {
    return errorOf([&](S&, M& m) {
      m.clear_skin();
      m.set_distance_cell(cell);
    });
  };
  EXPECT_THAT(
      rigid(0.3f),
      StartsWith("colliders[0].mesh.distanceCell = 0.3: is too coarse for this mesh; use at most 0.25"));
  EXPECT_THAT(rigid(0.01f), AllOf(StartsWith("colliders[0].mesh.distanceCell = 0.01: needs "),
                                  HasSubstr("must need at most 262144")));
  EXPECT_THAT(rigid(0), StartsWith("colliders[0].mesh.distanceCell = 0:"));
  EXPECT_THAT(rigid(std::nanf("")), StartsWith("colliders[0].mesh.distanceCell"));
}

TEST(SolidMessage, RefusesWrongJointsWithTheFieldAndTheReason) {
  using S = v1::Scene;
  using M = v1::ColliderMesh;
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_skin()->clear_joints(); }),
              StartsWith("colliders[0].mesh.skin.joints: has 0 elements; must have 1 to 128"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_skin()->mutable_joints(0)->set_parent(0); }),
              StartsWith("colliders[0].mesh.skin.joints[0].parent = 0: must be less than"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_skin()->set_vertex_joints(5, 2); }),
              StartsWith("colliders[0].mesh.skin.vertexJoints[5] = 2:"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_skin()->set_vertex_weights(4, 0.5f); }),
              StartsWith("colliders[0].mesh.skin.vertexWeights[4]: and the next three add up to 0.75"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_skin()->add_vertex_weights(1); }),
              StartsWith("colliders[0].mesh.skin.vertexWeights: has 17 elements"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_skin()->mutable_animation()->mutable_keys(1)->set_time(0); }),
              StartsWith("colliders[0].mesh.skin.animation.keys[1].time = 0:"));
  EXPECT_THAT(errorOf([](S&, M& m) { m.mutable_skin()->mutable_animation()->mutable_keys(1)->add_joints(); }),
              StartsWith("colliders[0].mesh.skin.animation.keys[1].joints: has 3 elements"));
}

// Reads an avatar from a file, with the animation and the scale of the message.
class AvatarFile : public testing::Test {
 protected:
  AvatarFile() {
    std::ofstream(path_, std::ios::binary) << meshes::SkinnedGlb().bytes();
    mesh_.set_file("rod.glb");
    reader_ = [this](const std::string&, const meshes::JointRequest* joints) {
      return meshes::readMeshFile(path_, {.bytes = 1'000'000, .vertices = 1000}, joints);
    };
  }
  ~AvatarFile() override { std::filesystem::remove(path_); }

  Result<model::Scene> scene() const {
    v1::Scene scene = smallScene();
    *scene.mutable_colliders(0)->mutable_mesh() = mesh_;
    return toScene(scene, reader_);
  }

  std::filesystem::path path_ = std::filesystem::temp_directory_path() / "clothstream_avatar_file.glb";
  v1::ColliderMesh mesh_;
  MeshReader reader_;
};

TEST_F(AvatarFile, GivesTheColliderItsJointsAndItsAnimation) {
  const Result<model::Scene> whole = scene();
  ASSERT_TRUE(whole) << whole.error().text;
  ASSERT_TRUE(meshOf(*whole).skin);
  EXPECT_EQ(meshOf(*whole).skin->vertices.size(), meshOf(*whole).vertices.size());
  EXPECT_GT(meshOf(*whole).skin->keys.size(), 3u);
  // The scene that clients get has no file, and the same bits.
  const v1::Scene message = toMessage(*whole);
  EXPECT_EQ(message.colliders(0).mesh().file(), "");
  const Result<model::Scene> again = toScene(message);
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(toMessage(*again).SerializeAsString(), message.SerializeAsString());
  mesh_.set_scale(0.5f);
  mesh_.set_animation("lift");
  const Result<model::Scene> half = scene();
  ASSERT_TRUE(half) << half.error().text;
  EXPECT_EQ(meshOf(*half).skin->keys.size(), 2u);
  EXPECT_EQ(meshOf(*half).vertices[5], 0.5f * meshOf(*whole).vertices[5]);
  EXPECT_EQ(meshOf(*half).skin->joints[0].rest.position, 0.5f * meshOf(*whole).skin->joints[0].rest.position);
}

TEST_F(AvatarFile, IsRefusedWithTheFieldAndTheReason) {
  const auto errorOf = [&] {
    const Result<model::Scene> made = scene();
    return made ? std::string("no error") : made.error().text;
  };
  mesh_.set_animation("run");
  EXPECT_THAT(errorOf(), AllOf(StartsWith("colliders[0].mesh.file = \"rod.glb\": "),
                               HasSubstr("has no animation \"run\"; must be one of bend, lift")));
  mesh_.clear_animation();
  mesh_.set_scale(10'000);
  EXPECT_THAT(errorOf(), StartsWith("colliders[0].mesh.positions"));
  mesh_ = sceneWithMesh().colliders(0).mesh();
  mesh_.set_animation("bend");
  EXPECT_THAT(errorOf(), StartsWith("colliders[0].mesh.animation = \"bend\": is an animation of a file"));
}

TEST_F(AvatarFile, NumbersOutOfTheWorldAreRefusedWithTheirJoint) {
  const auto errorOf = [&](const std::function<void(meshes::SkinnedGlb&)>& spoil) {
    meshes::SkinnedGlb glb;
    spoil(glb);
    std::ofstream(path_, std::ios::binary) << glb.bytes();
    const Result<model::Scene> made = scene();
    return made ? std::string("no error") : made.error().text;
  };
  using G = meshes::SkinnedGlb;
  EXPECT_EQ(
      errorOf([](G& g) {
        g.root["animations"][0]["samplers"][0]["input"] = g.add({0, 1, 1e30f}, "SCALAR");
      }),
      "colliders[0].mesh.file = \"rod.glb\": has an animation of 1e+30 s; must be at most 86400 s: export a "
      "shorter one");
  EXPECT_THAT(
      errorOf([](G& g) {
        g.root["nodes"][meshes::kUpper]["translation"] = {1e7, 0, 0};
      }),
      StartsWith("colliders[0].mesh.file = \"rod.glb\": has the joint \"upper\" 100000 m from its parent, "
                 "along one axis, 0 s after the animation begins; must be within 1000 m"));
  EXPECT_THAT(errorOf([](G& g) { g.root["nodes"][meshes::kUpper]["name"] = "a\x1b"; }),
              StartsWith("colliders[0].mesh.file = \"rod.glb\": has the joint 1 with the name \"a\\x1b\""));
}

TEST(SolidMessage, PosesOfJointsAreOfAColliderThatHasThem) {
  const model::Scene scene = *toScene(sceneWithMesh());
  v1::ColliderPoses message;
  v1::ColliderJoints& joints = *message.add_joints();
  joints.set_collider("ball");
  joints.add_joints()->mutable_position()->set_x(1);
  joints.add_joints();
  const auto poses = toPoses(message, scene);
  ASSERT_TRUE(poses) << poses.error().text;
  EXPECT_EQ(poses->joints[0].collider, 0u);
  EXPECT_EQ(poses->joints[0].joints[0].position.x(), 1);
  joints.add_joints();
  EXPECT_THAT(toPoses(message, scene).error().text,
              StartsWith("colliderPoses.joints[0].joints: has 3 elements; must have 2"));
  EXPECT_THAT(toPoses(message, *toScene(smallScene())).error().text,
              StartsWith("colliderPoses.joints[0].collider = \"ball\": has no joints"));
  joints.set_collider("nobody");
  EXPECT_THAT(toPoses(message, scene).error().text,
              StartsWith("colliderPoses.joints[0].collider = \"nobody\": must be one of ball"));
}

TEST(SolidMessage, BodiesThatAreTakenHaveJointsAndMayStand) {
  const model::Scene scene = *toScene(sceneWithMesh());
  v1::WearBody message;
  EXPECT_EQ(toWornBody(message, scene).value().colliders_size(), 0) << "the body is given back";
  message.set_collider("ball");
  EXPECT_EQ(toWornBody(message, scene).value().colliders_size(), 0) << "it keeps its motion";
  message.mutable_stands()->mutable_position()->set_y(2);
  const v1::ParameterChange change = toWornBody(message, scene).value();
  ASSERT_EQ(change.colliders_size(), 1);
  EXPECT_EQ(change.colliders(0).name(), "ball");
  EXPECT_EQ(change.colliders(0).position().y(), 2);
  EXPECT_EQ(change.colliders(0).orientation().w(), 1);
  EXPECT_THAT(toWornBody(message, *toScene(smallScene())).error().text,
              StartsWith("wearBody.collider = \"ball\": has no joints"));
  message.set_collider("stranger");
  EXPECT_THAT(toWornBody(message, scene).error().text,
              StartsWith("wearBody.collider = \"stranger\": must be one of ball"));
  message.set_collider("ball");
  model::Scene fine = scene;
  fine.stream.maxError = 1e-5f;
  const float far = 2 * model::reachOf(fine.stream);
  ASSERT_LT(far, 1000) << "the limit of positions";
  message.mutable_stands()->mutable_position()->set_y(far);
  EXPECT_THAT(toWornBody(message, fine).error().text, StartsWith("wearBody.stands = "));
  message.mutable_stands()->mutable_position()->set_y(std::numeric_limits<float>::quiet_NaN());
  EXPECT_THAT(toWornBody(message, scene).error().text, StartsWith("wearBody.stands.position.y = nan"));
}

TEST(SolidMessage, DescriptionHasTheNamesAndParentsOfJoints) {
  const model::Scene scene = *toScene(sceneWithMesh());
  v1::ColliderMeshDescription message;
  write(*std::get<model::Solid>(scene.colliders[0].shape), message);
  ASSERT_EQ(message.joint_names_size(), 2);
  EXPECT_EQ(message.joint_names(0), "root");
  EXPECT_EQ(message.joint_parents(0), 0u);
  EXPECT_EQ(message.joint_parents(1), 1u) << "the joint with index 0";
}

}  // namespace
}  // namespace clothstream::messages
