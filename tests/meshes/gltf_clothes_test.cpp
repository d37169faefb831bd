// SPDX-License-Identifier: MIT
// What clothes in glTF files have: several skins, many joints of a vertex, attributes, cubic animations.
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/meshes/mesh_file.h"
#include "tests/meshes/draco_sheet.h"
#include "tests/meshes/skinned_glb.h"

namespace clothstream::meshes {
namespace {

using nlohmann::json;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::size_t kRodVertices = 106;  // of SkinnedGlb

JointRequest ofCloth() {
  return {
      .animation = {}, .joints = 128, .keys = 1024, .poses = 16'384, .animated = false, .attributes = true};
}
JointRequest ofAvatar() {
  return {.animation = {}, .joints = 128, .keys = 1024, .poses = 16'384};
}

tl::expected<MeshSource, std::string> readBytes(const std::string& bytes, const JointRequest& joints) {
  const std::string name = ::testing::UnitTest::GetInstance()->current_test_info()->name();
  const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("clothstream_clothes_" + name + ".glb");
  std::ofstream(path, std::ios::binary) << bytes;
  auto source = readMeshFile(path, {.bytes = 1'000'000, .vertices = 1000}, &joints);
  std::filesystem::remove(path);
  return source;
}

std::string errorOf(const SkinnedGlb& glb, const JointRequest& joints) {
  const auto source = readBytes(glb.bytes(), joints);
  return source ? "no error" : source.error();
}

// Adds an accessor of whole numbers, whose component type is 5121 or 5123.
template <typename Number>
std::size_t addWhole(SkinnedGlb& glb, const std::vector<Number>& numbers, const char* type,
                     std::size_t components, bool normalized) {
  const int number = glb.add(std::vector<float>((numbers.size() * sizeof(Number) + 3) / 4, 0), "SCALAR");
  json& accessor = glb.root["accessors"][static_cast<std::size_t>(number)];
  accessor["componentType"] = sizeof(Number) == 1 ? 5121 : 5123;
  accessor["count"] = numbers.size() / components;
  accessor["type"] = type;
  accessor["normalized"] = normalized;
  const std::size_t offset = glb.root["bufferViews"][accessor["bufferView"].get<std::size_t>()]["byteOffset"];
  std::memcpy(glb.data.data() + offset, numbers.data(), numbers.size() * sizeof(Number));
  return static_cast<std::size_t>(number);
}

json& attributesOf(SkinnedGlb& glb, std::size_t mesh = 0) {
  return glb.root["meshes"][mesh]["primitives"][0]["attributes"];
}

// Adds a copy of the rod, 5 cm lower, with a skin whose inverse bind matrices raise it by 5 cm.
// `joints` and `backs` are its nodes, and the translations of their matrices along X.
void addLowerRod(SkinnedGlb& glb, const std::vector<int>& joints, const std::vector<float>& backs) {
  const std::size_t view =
      glb.root["accessors"][attributesOf(glb)["POSITION"].get<std::size_t>()]["bufferView"];
  const std::size_t offset = glb.root["bufferViews"][view]["byteOffset"];
  std::vector<float> positions(3 * kRodVertices);
  std::memcpy(positions.data(), glb.data.data() + offset, positions.size() * sizeof(float));
  for (std::size_t i = 1; i < positions.size(); i += 3) positions[i] -= 5;
  std::vector<float> weights, matrices;
  for (std::size_t i = 0; i < kRodVertices; ++i) weights.insert(weights.end(), {1, 0, 0, 0});
  for (const float back : backs)
    matrices.insert(matrices.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, back, 5, 0, 1});
  json mesh = glb.root["meshes"][0];
  mesh["name"] = "sleeve";
  glb.root["meshes"].push_back(mesh);
  attributesOf(glb, 1)["POSITION"] = glb.add(positions, "VEC3");
  attributesOf(glb, 1)["WEIGHTS_0"] = glb.add(weights, "VEC4");
  attributesOf(glb, 1)["JOINTS_0"] =
      addWhole(glb, std::vector<std::uint8_t>(4 * kRodVertices, 0), "VEC4", 4, false);
  glb.root["skins"].push_back(
      {{"name", "shirt"}, {"joints", joints}, {"inverseBindMatrices", glb.add(matrices, "MAT4")}});
  glb.root["nodes"].push_back({{"name", "sleeve"}, {"mesh", 1}, {"skin", 1}});
  glb.root["nodes"][kArmature]["children"].push_back(glb.root["nodes"].size() - 1);
}

TEST(GltfClothes, SkinsShareTheirJointsAndTheFrameOfTheFirst) {
  SkinnedGlb glb;
  addLowerRod(glb, {kLower}, {20});
  const auto source = readBytes(glb.bytes(), ofCloth());
  ASSERT_TRUE(source) << source.error();
  ASSERT_EQ(source->vertices.size(), 2 * kRodVertices);
  ASSERT_EQ(source->skin->joints.size(), 2u) << "both skins have the lower joint";
  ASSERT_EQ(source->skin->vertices.size(), 2 * kRodVertices);
  for (std::size_t i = 0; i < kRodVertices; ++i) {
    // Coordinates of 0.2 m, rounded to floats a few times.
    EXPECT_LT((source->vertices[kRodVertices + i] - source->vertices[i]).norm(), 1e-7f) << i;
    EXPECT_EQ(source->skin->vertices[kRodVertices + i].joints[0], 0) << "lower";
  }
}

TEST(GltfClothes, SkinsMayHaveJointsThatOthersDoNotHave) {
  SkinnedGlb glb;
  glb.root["nodes"].push_back({{"name", "tail"}, {"translation", {40, 0, 0}}});
  glb.root["nodes"][kLower]["children"].push_back(4);
  addLowerRod(glb, {4, kLower}, {-20, 20});
  JointRequest joints = ofCloth();
  const auto source = readBytes(glb.bytes(), joints);
  ASSERT_TRUE(source) << source.error();
  ASSERT_EQ(source->skin->joints.size(), 3u);
  EXPECT_EQ(source->skin->joints[0].name, "lower");
  EXPECT_EQ(source->skin->joints[1].name, "tail");
  EXPECT_EQ(source->skin->joints[1].parent, 0u);
  EXPECT_EQ(source->skin->joints[2].name, "upper") << "the first of the file, but its parent comes later";
  // 40 cm from the lower joint, where its skin binds it.
  EXPECT_NEAR(source->skin->joints[1].rest.position.x(), 0.4, 1e-6);
  EXPECT_NEAR(source->skin->joints[1].rest.position.y(), 0, 1e-6);
  EXPECT_EQ(source->skin->vertices.back().joints[0], 1);
  joints.joints = 2;
  EXPECT_THAT(
      errorOf(glb, joints),
      HasSubstr(
          ": its 2 skins: have 3 joints in all; must have at most 2: remove joints that move no vertex"));
}

TEST(GltfClothes, RefusesSkinsThatBindAJointAtTwoPlaces) {
  SkinnedGlb glb;
  addLowerRod(glb, {kLower, kUpper}, {20, 1});
  EXPECT_THAT(
      errorOf(glb, ofAvatar()),
      HasSubstr(
          ": its 2 skins: skin \"shirt\": binds joint 1 at another place than skin \"bones\": join their "
          "meshes, or export both in the same pose"));
}

TEST(GltfClothes, RefusesMoreSkinsThanAFigureNeeds) {
  SkinnedGlb glb;
  for (int i = 1; i <= 256; ++i) {
    glb.root["skins"].push_back(glb.root["skins"][0]);
    glb.root["nodes"].push_back({{"mesh", 0}, {"skin", i}});
    glb.root["nodes"][kArmature]["children"].push_back(glb.root["nodes"].size() - 1);
  }
  EXPECT_THAT(errorOf(glb, ofAvatar()), HasSubstr("has meshes with more than 256 skins: join meshes"));
}

TEST(GltfClothes, KeepsTheFourLargestWeightsOfAVertex) {
  SkinnedGlb glb;
  std::vector<float> matrices;
  for (int i = 0; i < 6; ++i) {
    if (i >= 2) glb.root["nodes"].push_back({{"name", "finger"}});
    if (i >= 2) glb.root["nodes"][kUpper]["children"].push_back(glb.root["nodes"].size() - 1);
    matrices.insert(matrices.end(), {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, i == 1 ? 20.0f : 0.0f, 0, 0, 1});
  }
  glb.root["skins"][0]["joints"] = {kUpper, kLower, 4, 5, 6, 7};
  glb.root["skins"][0]["inverseBindMatrices"] = glb.add(matrices, "MAT4");
  std::array<std::vector<std::uint8_t>, 2> joints;
  std::array<std::vector<float>, 2> weights;
  for (std::size_t i = 0; i < kRodVertices; ++i) {
    joints[0].insert(joints[0].end(), {0, 1, 2, 3});
    joints[1].insert(joints[1].end(), {4, 5, 0, 0});
    weights[0].insert(weights[0].end(), {0.3f, 0.1f, 0.05f, 0.2f});
    weights[1].insert(weights[1].end(), {0.25f, 0.1f, 0, 0});
  }
  for (std::size_t set = 0; set < 2; ++set) {
    attributesOf(glb)["JOINTS_" + std::to_string(set)] = addWhole(glb, joints[set], "VEC4", 4, false);
    attributesOf(glb)["WEIGHTS_" + std::to_string(set)] = glb.add(weights[set], "VEC4");
  }
  const auto source = readBytes(glb.bytes(), ofCloth());
  ASSERT_TRUE(source) << source.error();
  // The lower joint is number 0, the upper one 1, and the others keep their order. Of the two with 0.1 the
  // lower number stays.
  EXPECT_THAT(source->skin->vertices[7].joints, ElementsAre(1, 4, 3, 0));
  for (const auto& [k, weight] : {std::pair(0u, 0.3), {1u, 0.25}, {2u, 0.2}, {3u, 0.1}})
    EXPECT_NEAR(source->skin->vertices[7].weights[k], weight / 0.85, 1e-7);
}

TEST(GltfClothes, HasAttributesOfItsVertices) {
  SkinnedGlb glb;
  std::vector<float> distances(kRodVertices);
  for (std::size_t i = 0; i < kRodVertices; ++i) distances[i] = 0.5f * static_cast<float>(i);
  attributesOf(glb)["_MAX_DISTANCE"] = glb.add(distances, "SCALAR");
  attributesOf(glb)["_BACKSTOP_DISTANCE"] = glb.add(std::vector<float>(kRodVertices, 0.25f), "SCALAR");
  attributesOf(glb)["_BACKSTOP_RADIUS"] =
      addWhole(glb, std::vector<std::uint16_t>(kRodVertices, 0x3333), "SCALAR", 1, true);
  const auto source = readBytes(glb.bytes(), ofCloth());
  ASSERT_TRUE(source) << source.error();
  EXPECT_EQ(source->attributes.maxDistances, distances);
  EXPECT_EQ(source->attributes.backstopDistances, std::vector<float>(kRodVertices, 0.25f));
  EXPECT_THAT(source->attributes.backstopRadii, Each(0.2f)) << "0x3333 of 0xffff";
  EXPECT_TRUE(source->attributes.colours.empty());
  EXPECT_TRUE(source->skin->keys.empty()) << "no animation was asked for";
  EXPECT_TRUE(readBytes(glb.bytes(), ofAvatar())->attributes.maxDistances.empty())
      << "they were not asked for";
  // A second mesh without them.
  addLowerRod(glb, {kLower}, {20});
  attributesOf(glb, 1).erase("_MAX_DISTANCE");
  const auto both = readBytes(glb.bytes(), ofCloth());
  ASSERT_TRUE(both) << both.error();
  ASSERT_EQ(both->attributes.maxDistances.size(), 2 * kRodVertices);
  EXPECT_EQ(both->attributes.maxDistances[1], 0.5f);
  EXPECT_EQ(both->attributes.maxDistances[kRodVertices + 1], -1);
  EXPECT_EQ(both->attributes.backstopDistances[kRodVertices + 1], 0.25f);
  // Only in the second one.
  std::swap(attributesOf(glb, 0)["_MAX_DISTANCE"], attributesOf(glb, 1)["_MAX_DISTANCE"]);
  attributesOf(glb, 0).erase("_MAX_DISTANCE");
  const auto second = readBytes(glb.bytes(), ofCloth());
  ASSERT_TRUE(second) << second.error();
  EXPECT_EQ(second->attributes.maxDistances[1], -1);
  EXPECT_EQ(second->attributes.maxDistances[kRodVertices + 1], 0.5f);
}

TEST(GltfClothes, HasColoursOfEveryTypeThatGltfHas) {
  const auto colour = [](const std::function<std::size_t(SkinnedGlb&)>& add) {
    SkinnedGlb glb;
    attributesOf(glb)["COLOR_0"] = add(glb);
    const auto source = readBytes(glb.bytes(), ofCloth());
    EXPECT_TRUE(source) << source.error();
    EXPECT_EQ(source->attributes.colours.size(), kRodVertices);
    return source->attributes.colours[5];
  };
  EXPECT_EQ(
      colour([](SkinnedGlb& glb) { return glb.add(std::vector<float>(3 * kRodVertices, 0.25f), "VEC3"); }),
      Eigen::Vector4f(0.25f, 0.25f, 0.25f, 1));
  EXPECT_EQ(
      colour([](SkinnedGlb& glb) { return glb.add(std::vector<float>(4 * kRodVertices, 0.25f), "VEC4"); }),
      Eigen::Vector4f::Constant(0.25f));
  EXPECT_EQ(colour([](SkinnedGlb& glb) {
              return addWhole(glb, std::vector<std::uint8_t>(4 * kRodVertices, 51), "VEC4", 4, true);
            }),
            Eigen::Vector4f::Constant(0.2f));
  EXPECT_EQ(colour([](SkinnedGlb& glb) {
              return addWhole(glb, std::vector<std::uint16_t>(4 * kRodVertices, 0x3333), "VEC4", 4, true);
            }),
            Eigen::Vector4f::Constant(0.2f));
}

TEST(GltfClothes, RefusesAttributesThatAreNoNumbersOfItsVertices) {
  const auto refusal = [](const char* name, const std::function<std::size_t(SkinnedGlb&)>& add) {
    SkinnedGlb glb;
    attributesOf(glb)[name] = add(glb);
    EXPECT_EQ(errorOf(glb, ofAvatar()), "no error") << "an avatar has no such attributes";
    return errorOf(glb, ofCloth());
  };
  EXPECT_THAT(
      refusal("_MAX_DISTANCE",
              [](SkinnedGlb& glb) { return glb.add(std::vector<float>(3 * kRodVertices, 1), "VEC3"); }),
      HasSubstr("mesh \"rod\", primitive 0: _MAX_DISTANCE: has 3 numbers for each vertex; must have 1"));
  EXPECT_THAT(refusal("_BACKSTOP_RADIUS",
                      [](SkinnedGlb& glb) { return glb.add(std::vector<float>(7, 1), "SCALAR"); }),
              HasSubstr("primitive 0: _BACKSTOP_RADIUS: has 7 elements for 106 vertices"));
  EXPECT_THAT(refusal("COLOR_0",
                      [](SkinnedGlb& glb) { return glb.add(std::vector<float>(kRodVertices, 1), "SCALAR"); }),
              HasSubstr("primitive 0: COLOR_0: has 1 numbers for each vertex; must have 3 or 4"));
  EXPECT_THAT(
      refusal("COLOR_0",
              [](SkinnedGlb& glb) {
                return addWhole(glb, std::vector<std::uint8_t>(4 * kRodVertices, 51), "VEC4", 4, false);
              }),
      HasSubstr("primitive 0: COLOR_0: has integers that are not normalised; export floats, or normalised "
                "unsigned bytes or shorts"));
  EXPECT_THAT(refusal("_BACKSTOP_DISTANCE", [](SkinnedGlb&) { return std::size_t{99}; }),
              HasSubstr("primitive 0: _BACKSTOP_DISTANCE: accessor 99 does not exist"));
  EXPECT_THAT(
      refusal("_MAX_DISTANCE",
              [](SkinnedGlb& glb) {
                const int number = glb.add(std::vector<float>(kRodVertices, 1), "SCALAR");
                glb.root["accessors"][static_cast<std::size_t>(number)]["componentType"] = 5125;
                return number;
              }),
      HasSubstr("primitive 0: _MAX_DISTANCE: has numbers of a type that is neither float, byte nor short"));
}

// Of a file whose geometry is compressed, with four numbers for each vertex: x, 1 - x, 0, 0.
std::string compressedWith(const std::string& attribute) {
  std::string bytes = glbOf(compressedSheet(kDracoCodings[2], 20, false, true), 441, 2400, true);
  const auto replace = [&](const std::string& from, std::string to) {
    to.resize(from.size(), ' ');
    bytes.replace(bytes.find(from), from.size(), to);
  };
  replace(R"(, "skin": 0, "translation": [9, 9, 9])", "");
  replace(R"("JOINTS_0": 3, "WEIGHTS_0": 4)", '"' + attribute + "\": 4");
  replace(R"("JOINTS_0": 2, "WEIGHTS_0": 3)", '"' + attribute + "\": 3");
  return bytes;
}

TEST(GltfClothes, HasAttributesThatAreCompressed) {
  const auto source = readBytes(compressedWith("COLOR_0"), ofCloth());
  ASSERT_TRUE(source) << source.error();
  ASSERT_EQ(source->attributes.colours.size(), 441u);
  for (std::size_t i = 0; i < 441; ++i)
    EXPECT_EQ(source->attributes.colours[i],
              Eigen::Vector4f(source->vertices[i].x(), 1 - source->vertices[i].x(), 0, 0));
  EXPECT_FALSE(source->skin);
  EXPECT_THAT(readBytes(compressedWith("_MAX_DISTANCE"), ofCloth()).error(),
              HasSubstr("_MAX_DISTANCE: has 4 numbers for each vertex; must have 1"));
}

// The file with a cubic animation of the upper joint, at 0, 1 and 2.5 s.
struct CubicGlb {
  SkinnedGlb glb;
  std::vector<float> times{0, 1, 2.5f};
  // Slope before, value and slope after, of each key.
  std::vector<float> moves{0, 0, 0, 20, 0, 0, 30, 10, 0, 5, 5, -5, 18, 4,
                           2, 5, 5, -5, 0, 0, 40, 20, 0, 0, 0, 0,  0};
  std::vector<float> turns;

  CubicGlb() {
    const auto add = [&](const Eigen::Vector4f& slope, const Eigen::Quaternionf& turn) {
      for (const Eigen::Vector4f& four : {slope, Eigen::Vector4f(turn.coeffs()), slope})
        turns.insert(turns.end(), four.data(), four.data() + 4);
    };
    const auto about = [](float angle, const Eigen::Vector3f& axis) {
      return Eigen::Quaternionf(Eigen::AngleAxisf(angle, axis.normalized()));
    };
    add({0.1f, 0, 0.2f, 0}, Eigen::Quaternionf::Identity());
    add({0, 0.3f, 0, -0.1f}, about(1.2f, {1, 0, 1}));
    add({0, 0, 0, 0}, about(-0.5f, {0, 1, 1}));
    const int input = glb.add(times, "SCALAR");
    glb.root["animations"] = {{{"name", "sway"}, {"channels", json::array()}, {"samplers", json::array()}}};
    json& animation = glb.root["animations"][0];
    const std::array outputs{glb.add(moves, "VEC3"), glb.add(turns, "VEC4")};
    for (int i = 0; i < 2; ++i) {
      animation["samplers"].push_back({{"input", input},
                                       {"output", outputs[static_cast<std::size_t>(i)]},
                                       {"interpolation", "CUBICSPLINE"}});
      animation["channels"].push_back(
          {{"sampler", i}, {"target", {{"node", kUpper}, {"path", i == 0 ? "translation" : "rotation"}}}});
    }
  }

  // The value of `components` numbers at a time, by de Casteljau's construction of the same curve.
  Eigen::Vector4d at(const std::vector<float>& values, std::size_t components, double seconds) const {
    const std::size_t key = seconds < double{times[1]} ? 0 : 1;
    const double length = double{times[key + 1]} - double{times[key]},
                 part = (seconds - double{times[key]}) / length;
    const auto element = [&](std::size_t which) {
      Eigen::Vector4d four = Eigen::Vector4d::Zero();
      for (std::size_t c = 0; c < components; ++c)
        four[static_cast<Eigen::Index>(c)] = double{values[components * which + c]};
      return four;
    };
    std::vector<Eigen::Vector4d> points{
        element(3 * key + 1), element(3 * key + 1) + length / 3 * element(3 * key + 2),
        element(3 * key + 4) - length / 3 * element(3 * key + 3), element(3 * key + 4)};
    for (std::size_t left = 3; left > 0; --left)
      for (std::size_t i = 0; i < left; ++i) points[i] += part * (points[i + 1] - points[i]);
    return points[0];
  }
};

// The tolerances are those that gltf_skeleton.h states, plus the rounding of poses to floats.
TEST(GltfClothes, FollowsCubicAnimationsWithinHalfAMillimetreAndATenthOfADegree) {
  const CubicGlb cubic;
  const auto source = readBytes(cubic.glb.bytes(), ofAvatar());
  ASSERT_TRUE(source) << source.error();
  const std::vector<model::JointKey>& keys = source->skin->keys;
  EXPECT_EQ(keys.back().time, 2.5f);
  EXPECT_GT(keys.size(), 10u);
  EXPECT_LT(keys.size(), 200u);
  std::vector<model::Pose> local;
  double farthest = 0, mostTurned = 0;
  for (int i = 0; i < 2500; ++i) {
    const double seconds = 0.001 * i;
    model::jointsAt(*source->skin, seconds, local);
    const Eigen::Vector3d place = 0.01 * cubic.at(cubic.moves, 3, seconds).head<3>();
    const Eigen::Quaterniond turn = Eigen::Quaterniond(cubic.at(cubic.turns, 4, seconds)).normalized();
    farthest = std::max(farthest, (local[1].position.cast<double>() - place).norm());
    mostTurned = std::max(mostTurned, local[1].orientation.cast<double>().angularDistance(turn));
  }
  EXPECT_LE(farthest, 0.5e-3 + 1e-6);
  EXPECT_LE(mostTurned, 0.1 * std::acos(-1.0) / 180 + 1e-6);
  EXPECT_GT(farthest, 1e-5) << "keys are not denser than needed";
}

TEST(GltfClothes, LimitsTheKeysOfCubicAnimations) {
  const CubicGlb cubic;
  JointRequest joints = ofAvatar();
  joints.keys = 9;
  EXPECT_THAT(
      errorOf(cubic.glb, joints),
      HasSubstr("has an animation of more than 9 keys, or of more than 16384 poses of joints: export it with "
                "fewer keys"));
}

TEST(GltfClothes, RefusesCubicAnimationsThatAreNone) {
  const auto sampler = [](CubicGlb& cubic, std::size_t number) -> json& {
    return cubic.glb.root["animations"][0]["samplers"][number];
  };
  CubicGlb few;
  sampler(few, 0)["output"] = few.glb.add(std::vector<float>(9, 0), "VEC3");
  EXPECT_THAT(errorOf(few.glb, ofAvatar()),
              HasSubstr("has 3 values for 3 keys; a key of CUBICSPLINE has three"));
  CubicGlb other;
  sampler(other, 1)["interpolation"] = "BEZIER";
  EXPECT_THAT(
      errorOf(other.glb, ofAvatar()),
      HasSubstr(
          "channel 1 has the interpolation \"BEZIER\", which glTF does not have: export it with LINEAR, "
          "STEP or CUBICSPLINE"));
  CubicGlb through;
  for (std::size_t i = 0; i < through.turns.size(); ++i)
    through.turns[i] = i % 12 == 7 ? (i < 12 ? 1.0f : -1.0f) : 0.0f;
  sampler(through, 1)["output"] = through.glb.add(through.turns, "VEC4");
  EXPECT_THAT(errorOf(through.glb, ofAvatar()), HasSubstr("has poses of joints that are not finite"));
  CubicGlb infinite;
  infinite.moves[6] = 3e38f;
  sampler(infinite, 0)["output"] = infinite.glb.add(infinite.moves, "VEC3");
  EXPECT_THAT(errorOf(infinite.glb, ofAvatar()), HasSubstr("has an animation of more than 1024 keys"));
}

TEST(GltfClothes, AcceptsACubicScaleThatStays) {
  const auto scaled = [](float slope) {
    CubicGlb cubic;
    std::vector<float> scales;
    for (int key = 0; key < 3; ++key)
      scales.insert(scales.end(), {0, 0, 0, 1, 1, 1, key == 1 ? slope : 0, 0, 0});
    json& animation = cubic.glb.root["animations"][0];
    animation["samplers"][0]["output"] = cubic.glb.add(scales, "VEC3");
    animation["channels"][0]["target"]["path"] = "scale";
    return errorOf(cubic.glb, ofAvatar());
  };
  EXPECT_EQ(scaled(0), "no error");
  EXPECT_THAT(scaled(1),
              HasSubstr("channel 0 changes the scale, which is not supported: remove these keys, or move "
                        "joints instead of scaling them"));
}

TEST(GltfClothes, ReadsNoAnimationOfACloth) {
  CubicGlb cubic;
  cubic.glb.root["animations"][0]["channels"][0]["target"]["path"] = "weights";
  EXPECT_THAT(errorOf(cubic.glb, ofAvatar()), HasSubstr("changes \"weights\""));
  EXPECT_EQ(errorOf(cubic.glb, ofCloth()), "no error");
}

}  // namespace
}  // namespace clothstream::meshes
