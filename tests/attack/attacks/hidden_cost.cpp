// SPDX-License-Identifier: MIT
// Scenes and changes that cost more of the device's time than their size shows.
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

// `count` cloths that nothing passes through, `apart` metres above each other.
v1::Scene heap(std::uint32_t count, std::uint32_t size, std::uint32_t rate, float apart) {
  v1::Scene scene = sheet("heap", size, 8);
  scene.set_simulation_rate(rate);
  scene.mutable_cloths(0)->mutable_self_collision()->set_radius(0.01f);
  scene.mutable_cloths(0)->mutable_self_collision()->set_nothing_passes(true);
  for (std::uint32_t i = 1; i < count; ++i) {
    v1::Cloth& cloth = *scene.add_cloths();
    cloth = scene.cloths(0);
    cloth.set_name(fmt::format("sheet_{}", i));
    v1::Pose& pose = *cloth.mutable_grid()->mutable_pose();
    pose.mutable_position()->set_y(apart * static_cast<float>(i));
    pose.mutable_orientation()->set_w(1);
  }
  return scene;
}

// Creates the largest heap that the server accepts, and joins it.
std::string joinHeap(const Target& target, std::uint32_t count, std::uint32_t size, std::uint32_t rate,
                     float apart) {
  const auto stub = stubOf(target);
  const auto end = Clock::now() + target.time;
  std::string first;
  for (; count > 0; count /= 2) {
    const grpc::Status status = create(*stub, heap(count, size, rate, apart));
    if (first.empty()) first = answerOf(status);
    if (status.ok()) break;
  }
  Joined joined(*stub, "heap");
  std::this_thread::sleep_until(end);
  const std::string error = joined.lastError();
  return fmt::format("{}; accepted with {} cloths, {}", first, count,
                     error.empty() ? "runs" : "stopped: " + brief(error));
}

std::string joinCrowd(const Target& target) {
  return joinHeap(target, 256, 12, 1, 0);
}

std::string joinFastCrowd(const Target& target) {
  return joinHeap(target, 200, 8, 20, 0);
}

// Not crowded at its start: the sheets fall onto each other.
std::string joinFallingCrowd(const Target& target) {
  return joinHeap(target, 256, 12, 10, 0.02f);
}

v1::ClientMessage solverOf(std::uint32_t number) {
  v1::ClientMessage change;
  v1::Solver& solver = *change.mutable_parameter_change()->add_cloths()->mutable_solver();
  switch (number % 4) {
    case 0:
      solver.mutable_constraint()->set_iterations(1 + number / 4);
      break;
    case 1:
      solver.mutable_xpbd()->set_iterations(1 + number / 4);
      break;
    case 2:
      solver.mutable_implicit_euler()->set_iterations(1 + number / 4);
      break;
    default:
      solver.mutable_mass_spring();
      break;
  }
  return change;
}

// Changes the solver thirty times a second, between `kinds` settings.
std::string flipSolvers(const Target& target, const std::string& scene, std::uint32_t kinds) {
  const auto stub = stubOf(target);
  Joined joined(*stub, scene);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  std::uint32_t number = 0;
  repeat(target, [&] {
    joined.send(solverOf(number++ % kinds));
    std::this_thread::sleep_for(std::chrono::milliseconds(33));
  });
  return fmt::format("{} changes; the stream is {}", number, joined.open() ? "open" : "closed");
}

std::string flipTwoSolvers(const Target& target) {
  return flipSolvers(target, kVictimScene, 2);
}

std::string flipManySolvers(const Target& target) {
  return flipSolvers(target, kVictimScene, 24);
}

std::string flipSolversOfOwnScene(const Target& target) {
  const std::string answer = answerOf(create(*stubOf(target), sheet("small", 8, 4)));
  return answer + "; " + flipSolvers(target, "small", 24);
}

// Its tables take long to make.
std::string flipSolversOfLargeScene(const Target& target) {
  v1::Scene scene = sheet("large", 192, 1);
  scene.set_simulation_rate(20);
  scene.set_stream_rate(20);
  const std::string answer = answerOf(create(*stubOf(target), scene));
  return answer + "; " + flipSolvers(target, "large", 24);
}

// Bending, whose tables depend on which cloths bend.
std::string flipBending(const Target& target) {
  const auto stub = stubOf(target);
  v1::Scene scene = sheet("bends", 32, 4);
  *scene.add_cloths() = scene.cloths(0);
  scene.mutable_cloths(1)->set_name("other");
  const std::string answer = answerOf(create(*stub, scene));
  Joined joined(*stub, "bends");
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  bool first = false;
  repeat(target, [&] {
    first = !first;
    v1::ClientMessage change;
    for (const bool which : {true, false}) {
      v1::ClothChange& cloth = *change.mutable_parameter_change()->add_cloths();
      cloth.set_name(which ? "sheet" : "other");
      cloth.set_dihedral_bending(which == first ? 1e-6f : 0);
    }
    joined.send(change);
    std::this_thread::sleep_for(std::chrono::milliseconds(33));
  });
  const std::string error = joined.lastError();
  return answer + (error.empty() ? "" : "; " + brief(error));
}

// A closed mesh of 800 needles, all of which run from one corner of a cube of 10 m to the other: the box
// around each of them contains the whole cube.
void addNeedles(v1::ColliderMesh& mesh) {
  constexpr std::uint32_t kNeedles = 800;
  for (std::uint32_t needle = 0; needle < kNeedles; ++needle) {
    const float aside = 1e-3f * static_cast<float>(needle % 100),
                up = 1e-3f * static_cast<float>(needle / 100);
    const auto add = [&](float x, float y, float z) {
      for (const float number : {x + aside, y + up, z}) mesh.add_positions(number);
    };
    add(-5, -5, -5);
    add(-5, -5, -4.999f);
    add(-5, -4.999f, -5);
    add(5, 5, 5);
    for (const std::uint32_t corner : {0, 1, 2, 1, 0, 3, 2, 1, 3, 0, 2, 3})
      mesh.add_triangles(4 * needle + corner);
  }
}

// Creates the largest cloth in a heap of needles that the server accepts, and joins it.
std::string joinNeedles(const Target& target, float distanceCell) {
  const auto stub = stubOf(target);
  const auto end = Clock::now() + target.time;
  std::string first;
  std::uint32_t size = 64;
  for (; size > 1; size /= 2) {
    v1::Scene scene = sheet("needles", size, 4);
    scene.set_simulation_rate(10);
    scene.mutable_cloths(0)->add_pins()->set_last_column(size - 1);
    v1::Collider& collider = *scene.add_colliders();
    collider.set_name("needles");
    addNeedles(*collider.mutable_mesh());
    if (distanceCell > 0) collider.mutable_mesh()->set_distance_cell(distanceCell);
    const grpc::Status status = create(*stub, scene);
    if (first.empty()) first = answerOf(status);
    if (status.ok()) break;
  }
  Joined joined(*stub, "needles");
  std::this_thread::sleep_until(end);
  const std::string error = joined.lastError();
  return fmt::format("{}; accepted with {} nodes a side, {}", first, size,
                     error.empty() ? "runs" : "stopped: " + brief(error));
}

std::string joinTriangles(const Target& target) {
  return joinNeedles(target, 0);
}

std::string joinSampledTriangles(const Target& target) {
  return joinNeedles(target, 0.2f);
}

constexpr Attack kAttacksHiddenCost[] = {
    {"crowd", "create and join 256 cloths that nothing passes through, in one place, at 1 tick a second",
     &joinCrowd, "refused: .*--max-.*; accepted with [1-9][0-9]* cloths, .*"},
    {"fast_crowd", "the same with 200 smaller cloths at 20 ticks a second", &joinFastCrowd,
     "refused: .*--max-.*; accepted with [1-9][0-9]* cloths, .*"},
    {"falling_crowd", "256 such cloths that fall onto each other", &joinFallingCrowd,
     "(accepted|refused: .*--max-.*); accepted with [1-9][0-9]* cloths, .*"},
    {"needles", "create and join a cloth in a collider of 3,200 triangles that all lie in one place",
     &joinTriangles, "(accepted|refused: .*--max-.*); accepted with [1-9][0-9]* nodes a side, .*"},
    {"sampled_needles", "the same with sampled distances", &joinSampledTriangles,
     "(accepted|refused: .*--max-.*); accepted with [1-9][0-9]* nodes a side, .*"},
    {"flip_solver", "change the solver of the victim's scene to and fro 30 times a second", &flipTwoSolvers,
     "[0-9]+ changes; the stream is open"},
    {"flip_solvers", "the same between 24 settings", &flipManySolvers, "[0-9]+ changes; the stream is open"},
    {"flip_own_solver", "the same in a created scene of 64 nodes", &flipSolversOfOwnScene,
     "accepted; [0-9]+ changes; the stream is open"},
    {"flip_large_solver", "the same in a created scene of 36,864 nodes", &flipSolversOfLargeScene,
     "accepted; [0-9]+ changes; the stream is open"},
    {"flip_bending", "change which of two cloths bends 30 times a second", &flipBending, "accepted"},
};

}  // namespace

std::span<const Attack> hiddenCostAttacks() {
  return kAttacksHiddenCost;
}

}  // namespace clothstream::attack
