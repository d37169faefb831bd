// SPDX-License-Identifier: MIT
// Joints and animations of glTF files.
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/meshes/mesh_file.h"
#include "tests/meshes/skinned_glb.h"

namespace clothstream::meshes {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr FileLimits kSkinFileLimits{.bytes = 1'000'000, .vertices = 1000};

JointRequest request(const std::string& animation = {}) {
  return {.animation = animation, .joints = 128, .keys = 1024, .poses = 16'384};
}

tl::expected<MeshSource, std::string> read(const SkinnedGlb& glb, const JointRequest* joints) {
  const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("clothstream_" + name + ".glb");
  std::ofstream(path, std::ios::binary) << glb.bytes();
  auto source = readMeshFile(path, kSkinFileLimits, joints);
  std::filesystem::remove(path);
  return source;
}

// Where the joints of the source move a vertex.
Eigen::Vector3d posed(const MeshSource& source, std::size_t vertex, double seconds) {
  std::vector<model::Pose> local, poses;
  model::jointsAt(*source.skin, seconds, local);
  model::compose(*source.skin, local, poses);
  return model::skinned(source.skin->vertices[vertex], model::jointTransforms(*source.skin, poses),
                        source.vertices[vertex].cast<double>());
}

TEST(GltfSkin, MovesVerticesAsTheFileDoes) {
  const SkinnedGlb glb;
  const JointRequest joints = request();
  const auto source = read(glb, &joints);
  ASSERT_TRUE(source) << source.error();
  ASSERT_TRUE(source->skin);
  ASSERT_EQ(source->skin->vertices.size(), source->vertices.size());
  EXPECT_EQ(source->skin->joints[0].name, "lower");
  EXPECT_EQ(source->skin->joints[1].name, "upper");
  EXPECT_EQ(source->skin->joints[1].parent, 0u);
  EXPECT_EQ(source->skin->keys.back().time, static_cast<float>(kBendSeconds));
  for (const double seconds : {0.0, 0.3, 0.77, 1.0, 1.49, 1.51, 1.9})
    for (std::size_t i = 0; i < source->vertices.size(); ++i)
      // Between two keys, quaternions differ by at most 0.04 degrees from the arc, 0.2 m from the joint.
      ASSERT_LT((posed(*source, i, seconds) - glb.posed(i, seconds)).norm(), 2e-4)
          << "vertex " << i << " at " << seconds << " s";
}

TEST(GltfSkin, ReadsTheNamedAnimationAndRestsWithoutOne) {
  SkinnedGlb glb;
  JointRequest joints = request("lift");
  const auto lifted = read(glb, &joints);
  ASSERT_TRUE(lifted) << lifted.error();
  ASSERT_EQ(lifted->skin->keys.size(), 2u);
  EXPECT_EQ(lifted->skin->keys[1].time, 1.5f);
  joints = request("run");
  EXPECT_THAT(read(glb, &joints).error(), HasSubstr("has no animation \"run\"; must be one of bend, lift"));
  glb.root.erase("animations");
  glb.root["nodes"][kUpper]["rotation"] = {0, 0, 1, 0};
  joints = request();
  const auto still = read(glb, &joints);
  ASSERT_TRUE(still) << still.error();
  ASSERT_EQ(still->skin->keys.size(), 2u) << "the nodes have another pose than the bound one";
  EXPECT_NEAR(still->skin->keys[0].joints[1].orientation.z(), 1, 1e-6);
  EXPECT_NEAR(still->skin->joints[1].rest.orientation.w(), 1, 1e-6);
}

void expectPosed(const SkinnedGlb& glb, double seconds) {
  const auto source = read(glb, nullptr);
  ASSERT_TRUE(source) << source.error();
  EXPECT_FALSE(source->skin);
  for (std::size_t i = 0; i < source->vertices.size(); ++i)
    ASSERT_LT((source->vertices[i].cast<double>() - glb.posed(i, seconds)).norm(), 1e-5) << "vertex " << i;
}

// The node of the mesh has a translation, which does not count (glTF 2.0, 3.7.3.3).
TEST(GltfSkin, PlacesVerticesWhereTheNodesOfTheJointsAre) {
  SkinnedGlb glb;
  expectPosed(glb, 0);
  const double half = std::sqrt(0.5);
  glb.root["nodes"][kUpper]["rotation"] = {0, 0, half, half};
  expectPosed(glb, 1);
}

TEST(GltfSkin, PlacesVerticesByJointsThatScaleDifferentlyAlongTheAxes) {
  SkinnedGlb glb;
  glb.root["nodes"][kArmature] = {{"children", {kLower, 3}}, {"scale", {2, 3, -4}}};
  const auto scaled = read(glb, nullptr);
  ASSERT_TRUE(scaled) << scaled.error();
  glb.root["nodes"][kArmature]["scale"] = {1, 1, 1};
  const auto whole = read(glb, nullptr);
  for (std::size_t i = 0; i < whole->vertices.size(); ++i)
    ASSERT_LT((scaled->vertices[i] - whole->vertices[i].cwiseProduct(model::Vec3(2, 3, -4))).norm(), 1e-4f);
  EXPECT_EQ(scaled->faces[0].vertices[0], whole->faces[0].vertices[2]) << "a mirrored face is turned";
}

TEST(GltfSkin, SumsAllSetsOfJoints) {
  SkinnedGlb glb;
  json& attributes = glb.root["meshes"][0]["primitives"][0]["attributes"];
  attributes["JOINTS_1"] = attributes["JOINTS_0"];
  attributes["WEIGHTS_1"] = glb.add(std::vector<float>(424, 0), "VEC4");
  expectPosed(glb, 0);
  JointRequest joints = request();
  const auto none = read(glb, &joints);
  ASSERT_TRUE(none) << none.error();
  EXPECT_NEAR(none->skin->vertices[0].weights[0], 1, 1e-6);
  // Each vertex gets the same two weights a second time.
  attributes["WEIGHTS_1"] = attributes["WEIGHTS_0"];
  expectPosed(glb, 0);
  // Eight weights, of which six are the file's joint 0 and two are joint 1.
  attributes["WEIGHTS_0"] = glb.add(std::vector<float>(424, 0.125f), "VEC4");
  attributes["WEIGHTS_1"] = attributes["WEIGHTS_0"];
  const auto eight = read(glb, &joints);
  ASSERT_TRUE(eight) << eight.error();
  EXPECT_THAT(eight->skin->vertices[0].joints, ElementsAre(1, 0, 0, 0));
  EXPECT_THAT(eight->skin->vertices[0].weights, ElementsAre(0.75f, 0.25f, 0, 0));
}

TEST(GltfSkin, AFileWithoutSkinIsRigidUnlessAnAnimationIsNamed) {
  SkinnedGlb glb;
  glb.root["nodes"][3].erase("skin");
  JointRequest joints = request();
  const auto rigid = read(glb, &joints);
  ASSERT_TRUE(rigid) << rigid.error();
  EXPECT_FALSE(rigid->skin);
  joints = request("bend");
  EXPECT_THAT(read(glb, &joints).error(), HasSubstr("has no joints, so it has no animation"));
}

TEST(GltfSkin, NormalisedBytesAndShortsAreWeightsAndRotations) {
  SkinnedGlb glb;
  // The same weights as bytes of which 255 is 1; and shorts as joints.
  const auto source = read(glb, nullptr);
  json& attributes = glb.root["meshes"][0]["primitives"][0]["attributes"];
  const std::size_t vertices = source->vertices.size();
  std::string weights, joints;
  for (std::size_t i = 0; i < vertices; ++i) {
    weights += std::string("\xff\0\0\0", 4);
    joints += std::string("\1\0\0\0\0\0\0\0", 8);
  }
  const auto add = [&](const std::string& bytes, int type, bool normalized) {
    glb.root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", glb.data.size()}, {"byteLength", bytes.size()}});
    glb.root["accessors"].push_back({{"bufferView", glb.root["bufferViews"].size() - 1},
                                     {"componentType", type},
                                     {"count", vertices},
                                     {"normalized", normalized},
                                     {"type", "VEC4"}});
    glb.data += bytes;
    return glb.root["accessors"].size() - 1;
  };
  attributes["WEIGHTS_0"] = add(weights, 5121, true);
  attributes["JOINTS_0"] = add(joints, 5123, false);
  const JointRequest all = request();
  const auto read2 = read(glb, &all);
  ASSERT_TRUE(read2) << read2.error();
  EXPECT_THAT(read2->skin->vertices[3].weights, ElementsAre(1, 0, 0, 0));
  EXPECT_EQ(read2->skin->vertices[3].joints[0], 0) << "the file's joint 1 is the lower one";
}

TEST(GltfSkin, RefusesJointsThatCannotPlaceVertices) {
  const auto errorOf = [](const std::function<void(json&)>& spoil) {
    SkinnedGlb glb;
    spoil(glb.root);
    const auto source = read(glb, nullptr);
    return source ? std::string("no error") : source.error();
  };
  EXPECT_THAT(errorOf([](json& root) { root["nodes"][3]["skin"] = 5; }), HasSubstr("skin 5 does not exist"));
  EXPECT_THAT(errorOf([](json& root) {
                root["skins"][0]["joints"] = {kUpper, 99};
              }),
              HasSubstr("skin \"bones\": node 99 does not exist"));
  EXPECT_THAT(errorOf([](json& root) { root["nodes"][kUpper]["children"] = {kLower}; }),
              HasSubstr("has two parents or is its own ancestor"));
  EXPECT_THAT(errorOf([](json& root) { root["meshes"][0]["primitives"][0]["attributes"].erase("JOINTS_0"); }),
              HasSubstr("has a skin, but no JOINTS_0"));
}

TEST(GltfSkin, RefusesWhatIsNotSupportedWithTheReason) {
  const auto errorOf = [](const std::function<void(SkinnedGlb&)>& spoil, JointRequest joints = request()) {
    SkinnedGlb glb;
    spoil(glb);
    const auto source = read(glb, &joints);
    return source ? std::string("no error") : source.error();
  };
  using G = SkinnedGlb;
  EXPECT_EQ(errorOf([](G&) {}), "no error");
  const auto sampler = [](G& glb, int number) -> json& {
    return glb.root["animations"][0]["samplers"][static_cast<std::size_t>(number)];
  };
  const auto channel = [](G& glb) -> json& { return glb.root["animations"][0]["channels"][0]; };
  const auto attributes = [](G& glb) -> json& {
    return glb.root["meshes"][0]["primitives"][0]["attributes"];
  };
  EXPECT_THAT(
      errorOf([&](G& g) { sampler(g, 0)["interpolation"] = "CUBICSPLINE"; }),
      HasSubstr("animation \"bend\", channel 0 has 3 values for 3 keys; a key of CUBICSPLINE has three"));
  EXPECT_THAT(errorOf([&](G& g) { channel(g)["target"]["path"] = "weights"; }),
              HasSubstr("changes \"weights\", which is not supported"));
  EXPECT_THAT(errorOf([&](G& g) {
                channel(g)["target"]["path"] = "scale";
                sampler(g, 0)["output"] = g.add({1, 1, 1, 1, 2, 1, 1, 1, 1}, "VEC3");
              }),
              HasSubstr("changes the scale"));
  EXPECT_EQ(errorOf([&](G& g) {
              channel(g)["target"]["path"] = "scale";
              sampler(g, 0)["output"] = g.add(std::vector<float>(9, 1), "VEC3");
            }),
            "no error");
  EXPECT_THAT(errorOf([&](G& g) { g.root["animations"][0]["channels"][1] = channel(g); }),
              HasSubstr("channel 1 is the second one for the rotation of node 2"));
  EXPECT_THAT(errorOf([&](G& g) {
                sampler(g, 0)["input"] = g.add({0, 1, 1}, "SCALAR");
              }),
              HasSubstr("has times of keys that do not increase, at key 2"));
  EXPECT_THAT(errorOf([&](G& g) {
                sampler(g, 0)["input"] = g.add({0, 1}, "SCALAR");
              }),
              HasSubstr("has 3 values for 2 keys"));
  EXPECT_THAT(
      errorOf([&](G& g) { g.root["accessors"][sampler(g, 0)["input"].get<std::size_t>()]["count"] = 0; }),
      HasSubstr("has no elements"));
  EXPECT_THAT(errorOf([&](G& g) { sampler(g, 0)["output"] = g.add(std::vector<float>(12, 0), "VEC4"); }),
              HasSubstr("quaternions of length 1"));
  EXPECT_THAT(errorOf([](G&) {}, {.animation = {}, .joints = 128, .keys = 2, .poses = 16'384}),
              HasSubstr("has 3 keys; at most 2 are allowed"));
  EXPECT_THAT(errorOf([](G&) {}, {.animation = {}, .joints = 128, .keys = 1024, .poses = 8}),
              HasSubstr("or of more than 8 poses of joints"));
  EXPECT_THAT(errorOf([](G&) {}, {.animation = {}, .joints = 1, .keys = 1024, .poses = 16'384}),
              HasSubstr("skin \"bones\": has 2 joints; must have 1 to 1"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["nodes"][kLower]["scale"] = {1, 2, 1};
              }),
              HasSubstr("node 1 is mirrored, or scaled differently along its axes"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["nodes"][kLower]["rotation"] = {0, 0, 0, 0};
              }),
              HasSubstr("node 1 has a rotation of length 0"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["skins"][0].erase("name");
                g.root["skins"][0]["joints"] = json::array();
              }),
              HasSubstr("skin 0: has 0 joints"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["nodes"][kUpper]["scale"] = {2, 2, 2};
              }),
              HasSubstr("joint 1 has another scale than joint 0"));
  EXPECT_THAT(errorOf([](G& g) { g.root["nodes"][kUpper]["children"] = {kArmature}; }),
              HasSubstr("ancestor"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["skins"][0]["joints"] = {kUpper, kUpper};
              }),
              HasSubstr("has node 2 twice as a joint"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["skins"][0]["joints"] = {kUpper, 99};
              }),
              HasSubstr("node 99 does not exist"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["skins"][0]["inverseBindMatrices"] = g.add(std::vector<float>(16, 0), "MAT4");
              }),
              HasSubstr("has 1 inverse bind matrices for 2 joints"));
  EXPECT_THAT(errorOf([](G& g) {
                g.root["skins"][0]["inverseBindMatrices"] = g.add(std::vector<float>(32, 0), "MAT4");
              }),
              HasSubstr("inverse bind matrix 0 mirrors"));
  EXPECT_THAT(errorOf([](G& g) { g.root["nodes"][3]["skin"] = 5; }), HasSubstr("skin 5 does not exist"));
  EXPECT_THAT(errorOf([&](G& g) { attributes(g)["JOINTS_1"] = attributes(g)["JOINTS_0"]; }),
              HasSubstr("has a skin, but no WEIGHTS_1"));
  EXPECT_THAT(errorOf([&](G& g) { attributes(g)["WEIGHTS_1"] = attributes(g)["WEIGHTS_0"]; }),
              HasSubstr("has a skin, but no JOINTS_1"));
  EXPECT_THAT(errorOf([&](G& g) {
                attributes(g).erase("WEIGHTS_0");
                g.root["meshes"][0].erase("name");
              }),
              HasSubstr("mesh 0, primitive 0: has a skin, but no WEIGHTS_0"));
  EXPECT_THAT(errorOf([&](G& g) { attributes(g).erase("WEIGHTS_0"); }),
              HasSubstr("mesh \"rod\", primitive 0: has a skin, but no WEIGHTS_0"));
  EXPECT_THAT(
      errorOf([&](G& g) { attributes(g)["WEIGHTS_0"] = g.add(std::vector<float>(8, 0.25f), "VEC4"); }),
      HasSubstr("has 2 elements of WEIGHTS_0 for 106 vertices"));
  EXPECT_THAT(errorOf([&](G& g) { attributes(g)["WEIGHTS_0"] = g.add(std::vector<float>(424, 0), "VEC4"); }),
              HasSubstr("vertex 0 has no weight; its weights must add up to 1"));
  EXPECT_THAT(errorOf([&](G& g) { attributes(g)["WEIGHTS_0"] = g.add(std::vector<float>(424, -1), "VEC4"); }),
              HasSubstr("vertex 0 has the weight -1; must be 0 to 1"));
  EXPECT_THAT(errorOf([&](G& g) { g.root["skins"][0]["joints"] = {kUpper}; }),
              HasSubstr("has joint 1; the skin has 1 joints"));
  EXPECT_THAT(errorOf([&](G& g) {
                g.root["nodes"].push_back({{"mesh", 0}});
                g.root["nodes"][kArmature]["children"].push_back(4);
              }),
              HasSubstr("mesh \"rod\" has no skin, in contrast to others"));
}

}  // namespace
}  // namespace clothstream::meshes
