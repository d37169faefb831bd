// SPDX-License-Identifier: MIT
#include "tests/meshes/skinned_glb.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "tests/model/solids.h"

namespace clothstream::meshes {
namespace {

using nlohmann::json;

constexpr std::size_t kVec3Bytes = 12;

const Eigen::Quaterniond kTurn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 0.5).normalized()));
const Eigen::Vector3d kMove(0.1, 1.2, -0.3);

template <typename Number>
int addTo(SkinnedGlb& glb, const std::vector<Number>& numbers, int componentType, const char* type,
          std::size_t components) {
  glb.root["bufferViews"].push_back(
      {{"buffer", 0}, {"byteOffset", glb.data.size()}, {"byteLength", numbers.size() * sizeof(Number)}});
  glb.root["accessors"].push_back({{"bufferView", glb.root["bufferViews"].size() - 1},
                                   {"componentType", componentType},
                                   {"count", numbers.size() / components},
                                   {"type", type}});
  glb.data.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
  glb.data.resize((glb.data.size() + 3) / 4 * 4, '\0');
  return static_cast<int>(glb.root["accessors"].size()) - 1;
}

float shareOfUpper(float x) {
  return std::clamp(x / 10 + 0.5f, 0.0f, 1.0f);
}

}  // namespace

int SkinnedGlb::add(const std::vector<float>& numbers, const char* type) {
  const std::string name = type;
  const std::size_t components = name == "SCALAR" ? 1 : name == "VEC3" ? 3 : name == "VEC4" ? 4 : 16;
  return addTo(*this, numbers, 5126, type, components);
}

SkinnedGlb::SkinnedGlb() {
  const model::Solid rod = model::rodMesh(3, 40, 8, 12);
  std::vector<float> positions, weights, back(32, 0);
  std::vector<std::uint8_t> joints;
  std::vector<std::uint32_t> indices;
  for (const model::Vec3& vertex : rod->vertices) {
    positions.insert(positions.end(), {vertex.x(), vertex.y(), vertex.z()});
    weights.insert(weights.end(), {shareOfUpper(vertex.x()), 1 - shareOfUpper(vertex.x()), 0, 0});
    joints.insert(joints.end(), {0, 1, 0, 0});
  }
  for (const model::TriangleCorners& triangle : rod->triangles)
    indices.insert(indices.end(), triangle.begin(), triangle.end());
  // The upper joint is at the origin of the mesh, and the lower one at its end.
  for (std::size_t matrix = 0; matrix < 2; ++matrix)
    for (std::size_t i = 0; i < 4; ++i) back[16 * matrix + 5 * i] = 1;
  back[16 + 12] = 20;
  const auto half = static_cast<float>(std::sqrt(0.5));
  root = {{"asset", {{"version", "2.0"}}},        {"scene", 0},
          {"scenes", {{{"nodes", {kArmature}}}}}, {"buffers", json::array()},
          {"bufferViews", json::array()},         {"accessors", json::array()}};
  const int position = add(positions, "VEC3"), weight = add(weights, "VEC4"),
            joint = addTo(*this, joints, 5121, "VEC4", 4), index = addTo(*this, indices, 5125, "SCALAR", 1),
            matrices = add(back, "MAT4"), turns = add({0, 1, 2}, "SCALAR"),
            turned = add({0, 0, 0, 1, 0, 0, half, half, 0, 0, 0, 1}, "VEC4"),
            steps = add({0, 1.5f}, "SCALAR"), stepped = add({-20, 0, 0, -20, 5, 0}, "VEC3");
  root["nodes"] = {{{"name", "armature"},
                    {"children", {kLower, 3}},
                    {"translation", {kMove.x(), kMove.y(), kMove.z()}},
                    {"rotation", {kTurn.x(), kTurn.y(), kTurn.z(), kTurn.w()}},
                    {"scale", {0.01, 0.01, 0.01}}},
                   {{"name", "lower"}, {"children", {kUpper}}, {"translation", {-20, 0, 0}}},
                   {{"name", "upper"}, {"translation", {20, 0, 0}}},
                   {{"name", "rod"}, {"mesh", 0}, {"skin", 0}, {"translation", {7, 7, 7}}}};
  root["meshes"] = {{{"name", "rod"},
                     {"primitives",
                      {{{"attributes", {{"POSITION", position}, {"JOINTS_0", joint}, {"WEIGHTS_0", weight}}},
                        {"indices", index}}}}}};
  root["skins"] = {{{"name", "bones"}, {"joints", {kUpper, kLower}}, {"inverseBindMatrices", matrices}}};
  const auto target = [](int sampler, int node, const char* path) {
    return json{{"sampler", sampler}, {"target", {{"node", node}, {"path", path}}}};
  };
  root["animations"] = {{{"name", "bend"},
                         {"channels", {target(0, kUpper, "rotation"), target(1, kLower, "translation")}},
                         {"samplers",
                          {{{"input", turns}, {"output", turned}},
                           {{"input", steps}, {"output", stepped}, {"interpolation", "STEP"}}}}},
                        {{"name", "lift"},
                         {"channels", {target(0, kLower, "translation")}},
                         {"samplers", {{{"input", steps}, {"output", stepped}}}}}};
}

std::string SkinnedGlb::bytes() const {
  json whole = root;
  whole["buffers"] = {{{"byteLength", data.size()}}};
  std::string text = whole.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  const auto word = [](std::size_t value) {
    const auto number = static_cast<std::uint32_t>(value);
    return std::string(reinterpret_cast<const char*>(&number), sizeof number);
  };
  const std::string body =
      word(text.size()) + "JSON" + text + word(data.size()) + std::string("BIN\0", 4) + data;
  return "glTF" + word(2) + word(12 + body.size()) + body;
}

Eigen::Vector3d SkinnedGlb::posed(std::size_t vertex, double seconds) const {
  Eigen::Vector3f place;
  std::memcpy(place.data(), data.data() + kVec3Bytes * vertex, kVec3Bytes);
  const Eigen::Vector3d point = place.cast<double>();
  const double angle = std::acos(-1.0) / 2 * (1 - std::abs(seconds - 1)), lift = seconds < 1.5 ? 0 : 5;
  const Eigen::Affine3d armature = Eigen::Translation3d(kMove) * kTurn * Eigen::Scaling(0.01);
  const Eigen::Affine3d lower = armature * Eigen::Translation3d(-20, lift, 0);
  const Eigen::Affine3d upper =
      lower * Eigen::Translation3d(20, 0, 0) * Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ());
  const double share = double{shareOfUpper(place.x())};
  return share * (upper * point) + (1 - share) * (lower * Eigen::Translation3d(20, 0, 0) * point);
}

}  // namespace clothstream::meshes
