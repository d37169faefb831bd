// SPDX-License-Identifier: MIT
// Cloths that follow the joints of a collider, in messages and files.
#include <algorithm>
#include <array>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/messages/cloth_skin_message.h"
#include "server/messages/scene_file.h"
#include "server/messages/scene_message.h"
#include "server/messages/solid_message.h"
#include "tests/messages/scenes.h"
#include "tests/model/solids.h"

namespace clothstream::messages {
namespace {

using model::SkinLimits;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

// Share of the joint "right" at a place of the rod.
float shareOfRight(float x) {
  return std::clamp(x + 0.5f, 0.0f, 1.0f);
}

// smallScene() with a sheet of 5 x 4 nodes from x = -1 to 1, half a metre in front of a rod along X, which
// the joints "left" and "right" bend in its middle.
v1::Scene dressedScene() {
  v1::Scene scene = smallScene();
  model::ClosedMesh rod = *model::rodMesh(0.1f, 2, 8, 8);
  rod.skin.emplace();
  rod.skin->joints = {{.name = "left", .parent = {}, .rest = {}}, {.name = "right", .parent = 0, .rest = {}}};
  for (const model::Vec3& vertex : rod.vertices)
    rod.skin->vertices.push_back(
        {.joints = {0, 1, 0, 0}, .weights = {1 - shareOfRight(vertex.x()), shareOfRight(vertex.x()), 0, 0}});
  write(rod, *scene.mutable_colliders(0)->mutable_mesh());
  scene.mutable_colliders(0)->set_name("body");
  v1::Cloth& cloth = *scene.mutable_cloths(0);
  cloth.mutable_grid()->mutable_pose()->mutable_position()->set_z(0.5f);
  cloth.mutable_skin()->set_collider("body");
  return scene;
}

v1::ClothSkin& skin(v1::Scene& scene) {
  return *scene.mutable_cloths(0)->mutable_skin();
}

const model::ClothSkin& skinOf(const Result<model::Scene>& scene) {
  return *scene->cloths[0].skin;
}

// Binds all nodes to the joint "left".
void bindToLeft(v1::ClothSkin& message, int vertices) {
  for (int i = 0; i < vertices; ++i)
    for (const float weight : {1.0f, 0.0f, 0.0f, 0.0f}) {
      message.add_vertex_joints(0);
      message.add_vertex_weights(weight);
    }
}

// The surface is flat along X, so the nearest point has the x of the node. Weights are linear in x between
// vertices, and x = -0.5 and 0.5 are rings of vertices, so the barycentric mean is the share itself.
TEST(ClothSkin, TakesJointsFromTheNearestPointOfTheCollider) {
  const Result<model::Scene> scene = toScene(dressedScene());
  ASSERT_TRUE(scene) << scene.error().text;
  const std::vector<model::Vec3> nodes = model::restPositions(scene->cloths[0]);
  ASSERT_EQ(skinOf(scene).joints.size(), nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const model::VertexJoints& joints = skinOf(scene).joints[i];
    std::array<float, 2> weights{};
    for (std::size_t k = 0; k < 4; ++k) weights[joints.joints[k]] += joints.weights[k];
    // Positions and weights are floats near 1, with errors of 6e-8; a few of them add up.
    EXPECT_NEAR(weights[1], shareOfRight(nodes[i].x()), 1e-6) << "node " << i;
    EXPECT_NEAR(weights[0], 1 - shareOfRight(nodes[i].x()), 1e-6) << "node " << i;
  }
  EXPECT_EQ(skinOf(scene).limits[0], SkinLimits());
}

TEST(ClothSkin, KeepsEveryBitThroughAMessage) {
  v1::Scene message = dressedScene();
  v1::SkinRegion& region = *skin(message).add_regions();
  region.mutable_region()->set_radius(0.7f);
  region.mutable_region()->mutable_centre()->set_z(0.5f);
  region.mutable_limits()->set_max_distance(0.1f);
  region.mutable_limits()->set_backstop_distance(0.01f);
  region.mutable_limits()->set_backstop_radius(1.0f / 3);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  const v1::Scene written = toMessage(*scene);
  const Result<model::Scene> again = toScene(written);
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(toMessage(*again).SerializeAsString(), written.SerializeAsString());
  EXPECT_EQ(skinOf(again).limits, skinOf(scene).limits);
  for (std::size_t i = 0; i < skinOf(scene).joints.size(); ++i) {
    EXPECT_EQ(skinOf(again).joints[i].joints, skinOf(scene).joints[i].joints);
    EXPECT_EQ(skinOf(again).joints[i].weights, skinOf(scene).joints[i].weights);
  }
  // The same through the JSON that print-scene writes.
  const Result<model::Scene> fromJson = parseScene(toJson(*scene), "printed");
  ASSERT_TRUE(fromJson) << fromJson.error().text;
  EXPECT_EQ(toMessage(*fromJson).SerializeAsString(), written.SerializeAsString());
}

TEST(ClothSkin, LeavesListsOutWhereMeshesAreLeftOut) {
  const Result<model::Scene> scene = toScene(dressedScene());
  ASSERT_TRUE(scene) << scene.error().text;
  const v1::Scene message = toMessageWithoutMeshes(*scene);
  EXPECT_EQ(message.cloths(0).skin().collider(), "body");
  EXPECT_EQ(message.cloths(0).skin().vertex_joints_size(), 0);
}

TEST(ClothSkin, NormalisesWeightsAndKeepsNormalisedOnes) {
  v1::Scene message = dressedScene();
  bindToLeft(skin(message), 20);
  for (const auto& [index, weight] : {std::pair(0, 0.502f), {1, 0.502f}, {4, 0.3f}, {5, 0.7f}})
    skin(message).set_vertex_weights(index, weight);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  EXPECT_THAT(skinOf(scene).joints[0].weights, ElementsAre(0.5f, 0.5f, 0, 0));
  EXPECT_THAT(skinOf(scene).joints[1].weights, ElementsAre(0.3f, 0.7f, 0, 0));
}

TEST(ClothSkin, TakesLimitsFromTheLastThatHasThem) {
  v1::Scene message = dressedScene();
  v1::ClothSkin& s = skin(message);
  s.mutable_limits()->set_max_distance(0.5f);
  s.mutable_limits()->set_backstop_radius(0.25f);
  for (int i = 0; i < 20; ++i) s.add_max_distances(i < 2 ? 0.125f : -1);
  for (int i = 0; i < 20; ++i) s.add_backstop_distances(i == 0 ? 0.0625f : -0.5f);
  const auto around = [&](float x, float y) -> v1::SkinLimits& {
    v1::SkinRegion& region = *s.add_regions();
    region.mutable_region()->set_radius(0.1f);
    region.mutable_region()->mutable_centre()->set_x(x);
    region.mutable_region()->mutable_centre()->set_y(y);
    region.mutable_region()->mutable_centre()->set_z(0.5f);
    return *region.mutable_limits();
  };
  around(-0.5f, 0).set_max_distance(0.75f);  // node 1
  around(-0.5f, 0).set_max_distance(2);
  around(-0.5f, 0).set_backstop_radius(3);
  const Result<model::Scene> scene = toScene(message);
  ASSERT_TRUE(scene) << scene.error().text;
  const auto& limits = skinOf(scene).limits;
  EXPECT_EQ(limits[0], (SkinLimits{0.125f, 0.0625f, 0.25f}));
  EXPECT_EQ(limits[1], (SkinLimits{2, 0, 3}));
  EXPECT_EQ(limits[2], (SkinLimits{0.5f, 0, 0.25f}));
}

// A cloth in a file: a quad whose two triangles repeat the vertices of their common edge, so that six
// vertices are four nodes.
class ClothFile : public testing::Test {
 protected:
  ClothFile() {
    source_.vertices = {{0, 0, 0.5f}, {1, 0, 0.5f}, {0, 1, 0.5f}, {1, 0, 0.5f}, {1, 1, 0.5f}, {0, 1, 0.5f}};
    source_.faces = {{.cornerCount = 3, .vertices = {0, 1, 2, 0}, .uvs = {}},
                     {.cornerCount = 3, .vertices = {3, 4, 5, 0}, .uvs = {}}};
    model::Skin& joints = source_.skin.emplace();
    joints.joints = {{.name = "unused", .parent = {}, .rest = {}},
                     {.name = "right", .parent = 0, .rest = {}},
                     {.name = "left", .parent = 0, .rest = {}}};
    for (const std::uint8_t joint : std::array<std::uint8_t, 6>{1, 2, 1, 1, 2, 2})
      joints.vertices.push_back({.joints = {joint, 0, 0, 0}, .weights = {1, 0, 0, 0}});
    message_ = dressedScene();
    message_.mutable_cloths(0)->mutable_mesh()->set_file("shirt.glb");
    message_.mutable_cloths(0)->mutable_structural()->set_stiffness(0);
  }

  Result<model::Scene> scene() {
    return toScene(message_, [this](const std::string&, const meshes::JointRequest* joints) {
      EXPECT_TRUE(joints && joints->attributes && !joints->animated);
      return tl::expected<meshes::MeshSource, std::string>(source_);
    });
  }
  std::string error() {
    const Result<model::Scene> made = scene();
    return made ? "no error" : made.error().text;
  }
  // The limits of the node at x, y.
  static SkinLimits limitsAt(const Result<model::Scene>& scene, float x, float y) {
    return skinOf(scene).limits[nodeAt(scene, x, y)];
  }
  static std::size_t nodeAt(const Result<model::Scene>& scene, float x, float y) {
    const auto& nodes = scene->cloths[0].mesh->shape.positions;
    return static_cast<std::size_t>(std::ranges::find(nodes, model::Vec3(x, y, 0.5f)) - nodes.begin());
  }

  meshes::MeshSource source_;
  v1::Scene message_;
};

TEST_F(ClothFile, FindsJointsByNameAndKeepsThoseOfTheFirstJoinedVertex) {
  const Result<model::Scene> made = scene();
  ASSERT_TRUE(made) << made.error().text;
  ASSERT_EQ(made->cloths[0].nodeCount(), 4u);
  const auto jointAt = [&](float x, float y) { return skinOf(made).joints[nodeAt(made, x, y)].joints[0]; };
  EXPECT_EQ(jointAt(0, 0), 1) << "right";
  EXPECT_EQ(jointAt(1, 0), 0) << "left, from vertex 1; vertex 3 has another";
  EXPECT_EQ(jointAt(0, 1), 1) << "right, from vertex 2; vertex 5 has another";
  EXPECT_EQ(jointAt(1, 1), 0);
  // The message has the joints of the nodes, so no file is needed.
  const Result<model::Scene> again = toScene(toMessage(*made));
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(toMessage(*again).SerializeAsString(), toMessage(*made).SerializeAsString());
}

TEST_F(ClothFile, IsBoundByTheMessageIfThatHasJoints) {
  bindToLeft(skin(message_), 6);
  source_.skin->joints[1].name = "not of the body";
  const Result<model::Scene> made = scene();
  ASSERT_TRUE(made) << made.error().text;
  for (const model::VertexJoints& joints : skinOf(made).joints) EXPECT_EQ(joints.joints[0], 0);
}

TEST_F(ClothFile, IsRefusedIfNamesOfJointsDoNotTellThem) {
  source_.skin->joints[1].name = "wing\n";
  EXPECT_EQ(error(),
            "cloths[0].skin.collider = \"body\": has no joint \"wing\\x0a\", which moves vertices of the "
            "file: rename "
            "the joint in one of the files, or give \"vertexJoints\" and \"vertexWeights\"");
  source_.skin->joints[1].name = "left";
  EXPECT_EQ(error(), "cloths[0].skin: the file has two joints named \"left\": give them different names");
  source_.skin->joints[1].name = "";
  EXPECT_EQ(error(),
            "cloths[0].skin: the file has a joint without a name: name its joints as those of the collider, "
            "or give "
            "\"vertexJoints\" and \"vertexWeights\"");
  source_.skin->joints[1].name = "right";
  message_.mutable_colliders(0)->mutable_mesh()->mutable_skin()->mutable_joints(0)->set_name("right");
  EXPECT_EQ(error(),
            "cloths[0].skin.collider = \"body\": has two joints named \"right\": give them different names");
}

TEST_F(ClothFile, LimitsNodesByItsAttributesUnlessTheMessageDoes) {
  skin(message_).mutable_limits()->set_max_distance(8);
  skin(message_).mutable_limits()->set_backstop_radius(0.25f);
  source_.attributes.maxDistances = {1, 2, 3, 0.5f, -1, 4};
  source_.attributes.backstopDistances = {0, 0.125f, 0.5f, 0.25f, 0, 0.375f};
  source_.attributes.backstopRadii = {0, 1, 2, 3, -1, 2};
  Result<model::Scene> made = scene();
  ASSERT_TRUE(made) << made.error().text;
  EXPECT_EQ(limitsAt(made, 0, 0), (SkinLimits{1, 0, 0}));
  EXPECT_EQ(limitsAt(made, 1, 0), (SkinLimits{0.5f, 0.25f, 3}))
      << "the nearer distance and the larger backstop";
  EXPECT_EQ(limitsAt(made, 0, 1), (SkinLimits{3, 0.375f, 2})) << "of equal backstops the nearer";
  EXPECT_EQ(limitsAt(made, 1, 1), (SkinLimits{8, 0, 0.25f})) << "negative: those of `limits`";
  for (int i = 0; i < 6; ++i) skin(message_).add_max_distances(i == 0 ? 16 : -1);
  made = scene();
  ASSERT_TRUE(made) << made.error().text;
  EXPECT_EQ(limitsAt(made, 0, 0).maxDistance, 16);
  EXPECT_EQ(limitsAt(made, 1, 0).maxDistance, 0.5f);
}

TEST_F(ClothFile, LimitsNodesByAColourInsteadOfTheAttribute) {
  source_.attributes.maxDistances = {9, 9, 9, 9, 9, 9};
  source_.attributes.colours.assign(6, Eigen::Vector4f(0, 0.25f, 1, 1));
  source_.attributes.colours[4] = Eigen::Vector4f::Constant(-1);
  skin(message_).mutable_colour_distance()->set_channel(1);
  skin(message_).mutable_colour_distance()->set_distance(2);
  const Result<model::Scene> made = scene();
  ASSERT_TRUE(made) << made.error().text;
  EXPECT_EQ(limitsAt(made, 0, 0).maxDistance, 0.5f);
  EXPECT_EQ(limitsAt(made, 1, 1).maxDistance, SkinLimits::kUnbounded) << "a vertex without a colour";
}

TEST_F(ClothFile, IsRefusedForNumbersOutOfRange) {
  source_.attributes.maxDistances = {0, 0, 0, 0, 1001, 0};
  EXPECT_EQ(error(),
            "cloths[0].skin: vertex 4 of the file has the _MAX_DISTANCE 1001; must be a finite number from 0 "
            "to 1000, "
            "or negative for that of \"limits\"");
  source_.attributes = {};
  source_.attributes.backstopRadii = {0, kNan, 0, 0, 0, 0};
  EXPECT_EQ(
      error(),
      "cloths[0].skin: vertex 1 of the file has the _BACKSTOP_RADIUS nan; must be a finite number from 0 to "
      "1000, or negative for that of \"limits\"");
  source_.attributes = {};
  skin(message_).mutable_colour_distance()->set_distance(1);
  const std::string without =
      "cloths[0].skin.colourDistance: is for a mesh of a glTF \"file\" with COLOR_0, which this cloth has "
      "not: export "
      "the vertex colours, or give \"maxDistances\"";
  EXPECT_EQ(error(), without);
  source_.attributes.colours.assign(6, Eigen::Vector4f(0.5f, 0, 0, 1.5f));
  EXPECT_EQ(error(), "no error");
  skin(message_).mutable_colour_distance()->set_channel(3);
  EXPECT_EQ(
      error(),
      "cloths[0].skin.colourDistance: vertex 0 of the file has 1.5 in channel 3 of COLOR_0; must be 0 to 1");
}

// Two triangles that meet in one vertex become two sheets, and that vertex two nodes.
TEST_F(ClothFile, GivesCopiesOfANodeItsJointsAndLimits) {
  source_.vertices = {{0, 0, 0.5f}, {1, 0, 0.5f}, {0, 1, 0.5f}, {-1, 0, 0.5f}, {0, -1, 0.5f}, {9, 9, 9}};
  source_.faces = {{.cornerCount = 3, .vertices = {0, 1, 2, 0}, .uvs = {}},
                   {.cornerCount = 3, .vertices = {0, 3, 4, 0}, .uvs = {}}};
  message_.mutable_cloths(0)->mutable_mesh()->set_repair(true);
  source_.attributes.maxDistances = {0.25f, 1, 1, 1, 1, 1};
  const Result<model::Scene> made = scene();
  ASSERT_TRUE(made) << made.error().text;
  ASSERT_EQ(made->cloths[0].nodeCount(), 6u);
  std::vector<float> inTheMiddle;
  for (std::size_t i = 0; i < 6; ++i) {
    if (!made->cloths[0].mesh->shape.positions[i].head<2>().isZero()) continue;
    inTheMiddle.push_back(skinOf(made).limits[i].maxDistance);
    EXPECT_EQ(skinOf(made).joints[i].joints[0], 1);
    EXPECT_EQ(skinOf(made).joints[i].weights[0], 1);
  }
  EXPECT_THAT(inTheMiddle, ElementsAre(0.25f, 0.25f));
}

struct WrongSkin {
  std::string error;
  std::function<void(v1::Scene&)> spoil;
};

void expectErrors(const std::vector<WrongSkin>& wrong) {
  for (const WrongSkin& one : wrong) {
    v1::Scene message = dressedScene();
    one.spoil(message);
    const Result<model::Scene> scene = toScene(message);
    EXPECT_EQ(scene ? "no error" : scene.error().text, one.error);
    if (!scene) {
      EXPECT_EQ(scene.error().code, v1::ERROR_CODE_INVALID_ARGUMENT);
    }
  }
}

TEST(ClothSkin, IsRefusedWithoutAColliderThatHasJoints) {
  expectErrors({
      {"cloths[0].skin.collider = \"\": must be one of body", [](auto& s) { skin(s).clear_collider(); }},
      {"cloths[0].skin.collider = \"ghost\": must be one of body",
       [](auto& s) { skin(s).set_collider("ghost"); }},
      {"cloths[0].skin.collider = \"body\": the scene has none", [](auto& s) { s.clear_colliders(); }},
      {"cloths[0].skin.collider = \"body\": has no joints; must be a collider with a \"mesh\" that has them",
       [](auto& s) { s.mutable_colliders(0)->mutable_sphere()->set_radius(1); }},
      {"cloths[0].skin.collider = \"body\": is a mesh without joints; give it a \"skin\", or a file that has "
       "one",
       [](auto& s) { s.mutable_colliders(0)->mutable_mesh()->clear_skin(); }},
  });
}

TEST(ClothSkin, IsRefusedForWrongJointsAndWeights) {
  const auto bound = [](const std::function<void(v1::ClothSkin&)>& spoil) {
    return [spoil](v1::Scene& scene) {
      bindToLeft(skin(scene), 20);
      spoil(skin(scene));
    };
  };
  using S = v1::ClothSkin;
  expectErrors({
      {"no error", bound([](S&) {})},
      {"cloths[0].skin.vertexWeights: has 0 numbers for 20 vertices; must have 80, or none together with "
       "\"vertexJoints\"",
       bound([](S& s) { s.clear_vertex_weights(); })},
      {"cloths[0].skin.vertexJoints: has 0 numbers for 20 vertices; must have 80, or none together with "
       "\"vertexWeights\"",
       bound([](S& s) { s.clear_vertex_joints(); })},
      {"cloths[0].skin.vertexJoints: has 81 numbers for 20 vertices; must have 80, or none together with "
       "\"vertexWeights\"",
       bound([](S& s) { s.add_vertex_joints(0); })},
      {"cloths[0].skin.vertexJoints[5] = 2: must be a whole number from 0 to 1",
       bound([](S& s) { s.set_vertex_joints(5, 2); })},
      {"cloths[0].skin.vertexWeights[6] = -0.5: must be a finite number from 0 to 1",
       bound([](S& s) { s.set_vertex_weights(6, -0.5f); })},
      {"cloths[0].skin.vertexWeights[4] = nan: must be a finite number from 0 to 1",
       bound([](S& s) { s.set_vertex_weights(4, kNan); })},
      {"cloths[0].skin.vertexWeights[4]: and the next three add up to 0.75; must add up to 1",
       bound([](S& s) { s.set_vertex_weights(4, 0.75f); })},
  });
}

TEST(ClothSkin, IsRefusedForWrongLimits) {
  const auto at = [](v1::Scene& scene) -> v1::SkinLimits& {
    v1::SkinRegion& region = *skin(scene).add_regions();
    region.mutable_region()->set_radius(1);
    return *region.mutable_limits();
  };
  expectErrors({
      {"cloths[0].skin.limits.maxDistance = -1: must be a finite number from 0 to 1000",
       [](auto& s) { skin(s).mutable_limits()->set_max_distance(-1); }},
      {"cloths[0].skin.limits.backstopDistance = nan: must be a finite number from 0 to 1000",
       [](auto& s) { skin(s).mutable_limits()->set_backstop_distance(kNan); }},
      {"cloths[0].skin.limits.backstopRadius = 1001: must be a finite number from 0 to 1000",
       [](auto& s) { skin(s).mutable_limits()->set_backstop_radius(1001); }},
      {"cloths[0].skin.maxDistances: has 1 numbers for 20 vertices; must have 20, or none",
       [](auto& s) { skin(s).add_max_distances(1); }},
      {"cloths[0].skin.backstopDistances: has 21 numbers for 20 vertices; must have 20, or none",
       [](auto& s) {
         for (int i = 0; i < 21; ++i) skin(s).add_backstop_distances(1);
       }},
      {"cloths[0].skin.backstopRadii[3] = 1001: must be a finite number from 0 to 1000, or negative for that "
       "of "
       "\"limits\"",
       [](auto& s) {
         for (int i = 0; i < 20; ++i) skin(s).add_backstop_radii(i == 3 ? 1001 : 1);
       }},
      {"cloths[0].skin.maxDistances[0] = nan: must be a finite number from 0 to 1000, or negative for that "
       "of "
       "\"limits\"",
       [](auto& s) {
         for (int i = 0; i < 20; ++i) skin(s).add_max_distances(kNan);
       }},
      {"cloths[0].skin.maxDistances[0] = -inf: must be a finite number from 0 to 1000, or negative for that "
       "of "
       "\"limits\"",
       [](auto& s) {
         for (int i = 0; i < 20; ++i) skin(s).add_max_distances(-std::numeric_limits<float>::infinity());
       }},
      {"cloths[0].skin.colourDistance.channel = 4: must be a whole number from 0 to 3",
       [](auto& s) { skin(s).mutable_colour_distance()->set_channel(4); }},
      {"cloths[0].skin.colourDistance.distance = -1: must be a finite number from 0 to 1000",
       [](auto& s) { skin(s).mutable_colour_distance()->set_distance(-1); }},
      {"cloths[0].skin.colourDistance: is for a mesh of a glTF \"file\" with COLOR_0, which this cloth has "
       "not: export "
       "the vertex colours, or give \"maxDistances\"",
       [](auto& s) { skin(s).mutable_colour_distance()->set_distance(1); }},
      {"cloths[0].skin.regions[0].region: has no shape; must have \"radius\" or \"size\"",
       [](auto& s) { skin(s).add_regions()->mutable_limits()->set_max_distance(1); }},
      {"cloths[0].skin.regions[0].limits: has no number; must have one at least of \"maxDistance\", "
       "\"backstopDistance\" and \"backstopRadius\"",
       [&](auto& s) { at(s).clear_max_distance(); }},
      {"cloths[0].skin.regions[1].limits.backstopRadius = -1: must be a finite number from 0 to 1000",
       [&](auto& s) {
         at(s).set_max_distance(1);
         at(s).set_backstop_radius(-1);
       }},
  });
}

// The sheet is at z = 0.5.
TEST(ClothSkin, IsRefusedForARegionWithoutNodes) {
  const auto add = [](v1::Scene& scene, float z) {
    v1::SkinRegion& region = *skin(scene).add_regions();
    region.mutable_region()->mutable_centre()->set_z(z);
    region.mutable_region()->set_radius(1);
    region.mutable_limits()->set_max_distance(0);
  };
  v1::Scene message = dressedScene();
  add(message, 1);
  EXPECT_TRUE(toScene(message));
  add(message, -2);
  EXPECT_THAT(
      toScene(message).error().text,
      AllOf(StartsWith("cloths[0].skin.regions[1].region: contains no node of the cloth, which is between"),
            HasSubstr(" 0.5) and ("), HasSubstr(" 0.5) at rest")));
}

TEST(ClothSkin, IsRefusedForNodesThatTwoThingsMove) {
  const std::string error =
      "cloths[0].skin: has node 7, which follows its joints exactly (maxDistance 0), and which is pinned or "
      "attached: "
      "remove one of the two";
  const auto exact = [](v1::Scene& scene) {
    for (int i = 0; i < 20; ++i) skin(scene).add_max_distances(i == 7 ? 0 : 1);
  };
  expectErrors({
      {"no error", exact},
      {error,
       [&](v1::Scene& s) {
         exact(s);
         s.mutable_cloths(0)->add_pinned_vertices(7);
       }},
      {error,
       [&](v1::Scene& s) {
         exact(s);
         v1::Attachment& attachment = *s.mutable_cloths(0)->add_attachments();
         attachment.set_name("hook");
         attachment.add_vertices(7);
       }},
      {"no error",
       [&](v1::Scene& s) {
         exact(s);
         s.mutable_cloths(0)->add_pinned_vertices(8);
       }},
  });
}

TEST(ClothSkin, BoundsTheTimeThatRegionsTake) {
  v1::Scene message = dressedScene();
  v1::SkinRegion region;
  region.mutable_region()->set_radius(1);
  region.mutable_limits()->set_max_distance(1);
  for (int i = 0; i < 4097; ++i) *skin(message).add_regions() = region;
  EXPECT_EQ(toScene(message).error().text, "cloths[0].skin.regions: has 4097 elements; must have 0 to 4096");
  skin(message).mutable_regions()->RemoveLast();
  EXPECT_TRUE(toScene(message));
  v1::Grid& grid = *message.mutable_cloths(0)->mutable_grid();
  grid.set_rows(128);
  grid.set_columns(129);
  EXPECT_THAT(toScene(message).error().text,
              StartsWith("cloths: have pins, attachments and skins that select nodes in 67633152 steps"));
}

}  // namespace
}  // namespace clothstream::messages
