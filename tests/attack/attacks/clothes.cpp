// SPDX-License-Identifier: MIT
// Attacks by clothes: scenes whose skins are wrong or expensive, and joints that jump without end.
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN(),
                kInfinity = std::numeric_limits<float>::infinity();

// A ball of `rings` times `2 rings` quads with two joints, of which the upper half follows the second one.
v1::Collider figure(std::uint32_t rings, float radius) {
  v1::Collider collider;
  collider.set_name("figure");
  v1::ColliderMesh& mesh = *collider.mutable_mesh();
  v1::Skin& skin = *mesh.mutable_skin();
  skin.add_joints()->set_name("root");
  skin.add_joints()->set_name("upper");
  skin.mutable_joints(1)->set_parent(0);
  const std::uint32_t around = 2 * rings;
  const auto add = [&](double x, double y, double z) {
    for (const double number : {x, y, z}) mesh.add_positions(radius * static_cast<float>(number));
    for (std::uint32_t k = 0; k < 4; ++k) {
      skin.add_vertex_joints(k);
      skin.add_vertex_weights(k == (y > 0 ? 1u : 0u) ? 1.0f : 0.0f);
    }
    // Joints without a weight must exist, too.
    for (int k = 2; k < 4; ++k) skin.set_vertex_joints(skin.vertex_joints_size() - 4 + k, 0);
  };
  for (std::uint32_t ring = 1; ring < rings; ++ring)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double down = std::numbers::pi * ring / rings, turn = 2 * std::numbers::pi * i / around;
      add(std::sin(down) * std::cos(turn), std::cos(down), std::sin(down) * std::sin(turn));
    }
  const std::uint32_t top = around * (rings - 1), bottom = top + 1;
  add(0, 1, 0);
  add(0, -1, 0);
  const auto at = [&](std::uint32_t ring, std::uint32_t i) { return ring * around + i % around; };
  const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    for (const std::uint32_t corner : {a, b, c}) mesh.add_triangles(corner);
  };
  for (std::uint32_t i = 0; i < around; ++i) {
    triangle(top, at(0, i + 1), at(0, i));
    triangle(bottom, at(rings - 2, i), at(rings - 2, i + 1));
    for (std::uint32_t ring = 0; ring + 2 < rings; ++ring) {
      triangle(at(ring, i), at(ring, i + 1), at(ring + 1, i));
      triangle(at(ring, i + 1), at(ring + 1, i + 1), at(ring + 1, i));
    }
  }
  return collider;
}

// A sheet that follows the figure; it takes its joints from the nearest points.
v1::Scene clothes(const std::string& name, std::uint32_t size, std::uint32_t rings, std::uint32_t substeps) {
  v1::Scene scene = sheet(name, size, substeps);
  *scene.add_colliders() = figure(rings, 0.3f);
  v1::ClothSkin& skin = *scene.mutable_cloths(0)->mutable_skin();
  skin.set_collider("figure");
  skin.mutable_limits()->set_max_distance(0.05f);
  skin.mutable_limits()->set_backstop_radius(0.2f);
  return scene;
}

// Sets joints and weights of all vertices.
void setJoints(v1::ClothSkin& skin, std::uint32_t vertices, std::uint32_t joint, float weight) {
  for (std::uint32_t i = 0; i < 4 * vertices; ++i) {
    skin.add_vertex_joints(i % 4 == 0 ? joint : 0);
    skin.add_vertex_weights(i % 4 == 0 ? weight : 0);
  }
}

// Each change makes a skin of 64 vertices wrong.
std::string createWrongSkins(const Target& target) {
  using Wrong = std::function<void(v1::ClothSkin&)>;
  const std::array<Wrong, 16> all{
      [](v1::ClothSkin& skin) { setJoints(skin, 64, 0, kNan); },
      [](v1::ClothSkin& skin) { setJoints(skin, 64, 0, kInfinity); },
      [](v1::ClothSkin& skin) { setJoints(skin, 64, 0, 0); },
      [](v1::ClothSkin& skin) { setJoints(skin, 64, 2, 1); },
      [](v1::ClothSkin& skin) { setJoints(skin, 64, 0xffffffff, 1); },
      [](v1::ClothSkin& skin) { setJoints(skin, 63, 0, 1); },
      [](v1::ClothSkin& skin) { setJoints(skin, 100'000, 0, 1); },
      [](v1::ClothSkin& skin) { skin.add_vertex_joints(0); },
      [](v1::ClothSkin& skin) { skin.mutable_limits()->set_max_distance(kNan); },
      [](v1::ClothSkin& skin) { skin.mutable_limits()->set_backstop_radius(1e30f); },
      [](v1::ClothSkin& skin) { skin.mutable_max_distances()->Resize(64, kInfinity); },
      [](v1::ClothSkin& skin) { skin.mutable_backstop_distances()->Resize(64, -kInfinity); },
      [](v1::ClothSkin& skin) { skin.mutable_backstop_radii()->Resize(1'000'000, 0); },
      [](v1::ClothSkin& skin) { skin.add_regions()->mutable_region()->set_radius(kNan); },
      [](v1::ClothSkin& skin) { skin.mutable_colour_distance()->set_channel(0xffffffff); },
      [](v1::ClothSkin& skin) { skin.set_collider(std::string(10'000, '\x1b')); },
  };
  const auto stub = stubOf(target);
  Answers answers;
  std::size_t number = 0;
  repeat(target, [&] {
    v1::Scene scene = clothes("wrong", 8, 8, 4);
    all[number++ % all.size()](*scene.mutable_cloths(0)->mutable_skin());
    answers.add(create(*stub, scene));
  });
  return answers.text();
}

// A million vertices whose joints are sought on a body, with as many regions as they may have.
std::string createHugeClothes(const Target& target) {
  const auto stub = stubOf(target);
  std::string answer;
  repeat(target, [&] {
    v1::Scene scene = clothes("huge", 1024, 70, 1);
    for (int i = 0; i < 60; ++i) {
      v1::SkinRegion& region = *scene.mutable_cloths(0)->mutable_skin()->add_regions();
      region.mutable_region()->set_radius(1000);
      region.mutable_limits()->set_max_distance(0.01f);
    }
    answer = upload(*stub, scene.SerializeAsString());
  });
  return answer;
}

// Cloth at the centre of the ball, so that all triangles are equally near, as many as the server accepts.
std::string createEquallyNear(const Target& target) {
  const auto stub = stubOf(target);
  std::uint32_t size = 512;
  std::string answer = "nothing was accepted";
  for (; size >= 16; size /= 2) {
    v1::Scene scene = clothes(fmt::format("near_{}", size), size, 70, 1);
    scene.set_simulation_rate(10);
    scene.set_stream_rate(10);
    scene.mutable_cloths(0)->mutable_grid()->set_width(0.002f * static_cast<float>(size));
    scene.mutable_cloths(0)->mutable_grid()->set_height(0.002f * static_cast<float>(size));
    if (!upload(*stub, scene.SerializeAsString()).starts_with("accepted")) continue;
    const Joined joined(*stub, scene.name());
    std::this_thread::sleep_for(target.time);
    return fmt::format("accepted with {} nodes a side; the stream {}", size,
                       joined.open() ? "stays open" : "was closed");
  }
  return answer;
}

v1::ClientMessage jointsAt(float x, bool jumps) {
  v1::ClientMessage message;
  v1::ColliderJoints& moved = *message.mutable_collider_poses()->add_joints();
  moved.set_collider("figure");
  moved.set_jumps(jumps);
  for (int joint = 0; joint < 2; ++joint) {
    v1::Pose& pose = *moved.add_joints();
    if (joint == 0) pose.mutable_position()->set_x(x);
    pose.mutable_orientation()->set_w(1);
  }
  return message;
}

// Joints that are elsewhere in every tick: near, as far as the server accepts, and farther.
std::string throwJoints(const Target& target) {
  const auto stub = stubOf(target);
  const std::string answer = answerOf(create(*stub, clothes("thrown", 32, 16, 8)));
  Joined joined(*stub, "thrown");
  constexpr std::array kPlaces{0.0f, 5.0f, -5.0f, 30.0f, -30.0f, 999.0f, 1e30f, kNan};
  std::size_t number = 0;
  repeat(target, [&] {
    ++number;
    joined.send(jointsAt(kPlaces[number * 5 % kPlaces.size()], number % 3 != 0));
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  });
  const std::string error = joined.lastError();
  return fmt::format("{}; {}, {} rollbacks, {}", answer,
                     joined.open() ? "the stream stays open" : "the stream was closed", joined.rolledBack(),
                     error.empty() ? "no error" : "refused: " + brief(error));
}

constexpr Attack kAttacksClothes[] = {
    {"wrong_skins", "create clothes with joints, weights and limits that are out of range, without end",
     &createWrongSkins, "[0-9]+ refused with code (3|8)(, [0-9]+ refused with code 8)?"},
    {"huge_clothes", "create clothes of a million vertices on a body of 20,000 triangles, without end",
     &createHugeClothes, "refused: .*"},
    {"equally_near", "create clothes in the middle of a ball, so that all of its triangles are equally near",
     &createEquallyNear, "accepted with [0-9]+ nodes a side; the stream stays open"},
    {"thrown_joints", "move the joints of a dressed figure far away in every tick, and to NaN", &throwJoints,
     "accepted; the stream stays open, [0-9]+ rollbacks, refused: .*"},
};

}  // namespace

std::span<const Attack> clothesAttacks() {
  return kAttacksClothes;
}

}  // namespace clothstream::attack
