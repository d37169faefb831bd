// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>

#include "tests/attack/attacks/attacker.h"

namespace clothstream::attack {
namespace {

std::string createHugeSolve(const Target& target) {
  return answerOf(create(*stubOf(target), constrained("evil", 512, 64, 10'000)));
}

std::string createHugeGrid(const Target& target) {
  return answerOf(create(*stubOf(target), sheet("huge", 4096, 1)));
}

std::string raiseIterations(const Target& target) {
  const auto stub = stubOf(target);
  Joined joined(*stub, "solver_constraint");
  v1::ClientMessage change;
  v1::ClothChange& cloth = *change.mutable_parameter_change()->add_cloths();
  cloth.mutable_solver()->mutable_constraint()->set_iterations(10'000);
  cloth.mutable_solver()->mutable_constraint()->set_tolerance(0);
  std::this_thread::sleep_for(std::chrono::seconds(1));
  joined.send(change);
  std::this_thread::sleep_for(target.time);
  const std::string error = joined.lastError();
  return error.empty() ? "accepted" : "refused: " + brief(error);
}

std::string fillBudget(const Target& target) {
  const auto stub = stubOf(target);
  std::vector<std::unique_ptr<Joined>> joined;
  std::uint32_t size = 128;
  std::string sizes;
  for (int scene = 0; scene < 64 && size >= 2;) {
    const std::string name = fmt::format("filler_{}", scene);
    if (!create(*stub, sheet(name, size, 10)).ok()) {
      size /= 2;
      continue;
    }
    sizes += fmt::format(" {}", size);
    joined.push_back(std::make_unique<Joined>(*stub, name));
    ++scene;
  }
  std::this_thread::sleep_for(target.time);
  return fmt::format("{} scenes accepted, of these sizes:{}", joined.size(), sizes);
}

std::string createAndDelete(const Target& target) {
  const auto stub = stubOf(target);
  Answers answers;
  repeat(target, [&] {
    answers.add(create(*stub, sheet("again", 64, 4)));
    grpc::ClientContext context;
    v1::DeleteSceneRequest request;
    request.set_name("again");
    v1::DeleteSceneResponse response;
    stub->DeleteScene(&context, request, &response);
  });
  return answers.text();
}

// Many cloths, each of which is cheap.
std::string createManyCloths(const Target& target) {
  v1::Scene scene = constrained("many", 16, 16, 1'000);
  for (int i = 1; i < 256; ++i) {
    v1::Cloth& cloth = *scene.add_cloths();
    cloth = scene.cloths(0);
    cloth.set_name(fmt::format("sheet_{}", i));
  }
  return answerOf(create(*stubOf(target), scene));
}

// A double pyramid with 64 corners around its axis.
v1::ConvexHull spindle() {
  constexpr std::uint32_t kCorners = 64;
  v1::ConvexHull hull;
  const auto add = [&](double x, double y, double z) {
    v1::Vec3& corner = *hull.add_vertices();
    corner.set_x(static_cast<float>(x));
    corner.set_y(static_cast<float>(y));
    corner.set_z(static_cast<float>(z));
  };
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    const double angle = 2 * std::numbers::pi * i / kCorners;
    add(0.3 * std::cos(angle), 0, 0.3 * std::sin(angle));
  }
  add(0, 0.3, 0);
  add(0, -0.3, 0);
  for (std::uint32_t i = 0; i < kCorners; ++i) {
    const std::uint32_t next = (i + 1) % kCorners;
    for (const auto& face : {std::array{next, i, kCorners}, std::array{i, next, kCorners + 1}})
      hull.add_faces()->mutable_vertices()->Assign(face.begin(), face.end());
  }
  return hull;
}

// As many of the most expensive colliders as a scene may have.
std::string createHulls(const Target& target) {
  const auto stub = stubOf(target);
  v1::Scene scene = sheet("hulls", 128, 10);
  for (int i = 0; i < 64; ++i) {
    v1::Collider& collider = *scene.add_colliders();
    collider.set_name(fmt::format("hull_{}", i));
    collider.mutable_pose()->mutable_orientation()->set_w(1);
    *collider.mutable_hull() = spindle();
  }
  const std::string answer = upload(*stub, scene.SerializeAsString());
  const Joined joined(*stub, "hulls");
  std::this_thread::sleep_for(target.time);
  return answer;
}

// Pins of the same nodes, which every change of parameters checks again.
std::string changeDuplicatePins(const Target& target) {
  const auto stub = stubOf(target);
  v1::Scene scene = sheet("pins", 128, 4);
  for (int i = 0; i < 4096; ++i) {
    v1::GridRange& pins = *scene.mutable_cloths(0)->add_pins();
    pins.set_last_row(127);
    pins.set_last_column(127);
  }
  const std::string answer = answerOf(create(*stub, scene));
  Joined joined(*stub, "pins");
  repeat(target, [&] {
    joined.send(windOf(0.01f));
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  });
  return answer;
}

std::string joinEveryScene(const Target& target) {
  const auto stub = stubOf(target);
  grpc::ClientContext context;
  v1::ListScenesResponse scenes;
  stub->ListScenes(&context, {}, &scenes);
  std::vector<std::unique_ptr<Joined>> joined;
  for (const v1::SceneSummary& scene : scenes.scenes())
    joined.push_back(std::make_unique<Joined>(*stub, scene.name()));
  std::this_thread::sleep_for(target.time);
  const auto open = std::ranges::count_if(joined, [](const auto& each) { return each->open(); });
  return fmt::format("{} of {} scenes stay open", open, joined.size());
}

// The largest solve that the server accepts, which still runs when the server has to end.
std::string solveAtTheEnd(const Target& target) {
  const auto stub = stubOf(target);
  std::uint32_t size = 512;
  while (size > 4 && !create(*stub, constrained("last", size, 16, 100)).ok()) size /= 2;
  const Joined joined(*stub, "last");
  std::this_thread::sleep_for(target.time + std::chrono::seconds(2));
  return fmt::format("accepted with {} nodes a side", size);
}

// A part of the mesh of a surface: `vertices` corners at random within the cloth, and as many triangles of
// them. Some are not numbers.
v1::ClientMessage surfacePart(std::uint32_t id, std::uint32_t index, std::uint32_t count,
                              std::mt19937& random, bool valid) {
  constexpr int kElements = 1'500;
  std::uniform_real_distribution<float> place(-0.5f, 0.5f);
  std::uniform_int_distribution<std::uint32_t> corner(0, kElements - 1);
  v1::ClientMessage message;
  v1::SurfaceUpdate& update = *message.mutable_surface();
  update.set_id(id);
  v1::SurfacePart& part = *update.mutable_part();
  part.set_index(index);
  part.set_count(count);
  part.set_two_sided(true);
  for (int i = 0; i < kElements; ++i)
    for (const float base : {0.0f, 1.0f, 0.0f}) part.add_positions(base + place(random));
  if (!valid) part.set_positions(7, std::numeric_limits<float>::quiet_NaN());
  for (int i = 0; i < 3 * kElements; ++i) part.add_triangles(corner(random));
  return message;
}

// Heaps of triangles in the cloth, which are replaced without end, and between them parts that do not fit.
std::string sendSurfaces(const Target& target) {
  const auto stub = stubOf(target);
  v1::Scene scene = sheet("heaped", 32, 10);
  if (const grpc::Status made = create(*stub, scene); !made.ok()) return answerOf(made);
  Joined joined(*stub, scene.name());
  std::mt19937 random(3);
  std::uint32_t number = 0;
  repeat(target, [&] {
    const std::uint32_t id = ++number % 70;
    for (std::uint32_t index = 0; index < 4; ++index)
      joined.send(surfacePart(id, number % 5 == 0 ? index ^ 1u : index, 4, random, number % 3 != 0));
    std::this_thread::sleep_for(std::chrono::milliseconds(30));
  });
  const std::string error = joined.lastError();
  return fmt::format("{}, {}", joined.open() ? "the stream stays open" : "the stream was closed",
                     error.empty() ? "no error" : "refused: " + brief(error));
}

constexpr Attack kAttacksWork[] = {
    {"huge_solve", "create 512x512 constraints with 10,000 iterations and 64 substeps", &createHugeSolve,
     "refused: .*--max-load.*"},
    {"many_cloths", "create 256 cloths of constraints with 1,000 iterations and 16 substeps",
     &createManyCloths, "refused: .*--max-load.*"},
    {"huge_grid", "create 4,096x4,096 nodes", &createHugeGrid, "refused: .*"},
    {"hulls", "create and join a scene with 64 hulls of 128 faces", &createHulls,
     "(accepted.*|refused: .*--max-.*)"},
    {"duplicate_pins", "change parameters of a scene with 4,096 ranges of the same pins",
     &changeDuplicatePins, "(accepted|refused: .*)"},
    {"every_scene", "join every scene that the server starts with", &joinEveryScene,
     "[0-9]+ of [0-9]+ scenes stay open"},
    {"raise_iterations", "raise the iterations of a scene with 1,024 nodes to 10,000", &raiseIterations,
     "refused: .*--max-.*"},
    {"fill_budget", "create and join as many scenes as the budget allows", &fillBudget,
     "[0-9]+ scenes accepted, .*"},
    {"create_and_delete", "create and delete a scene without end", &createAndDelete,
     "[0-9]+ accepted(, [0-9]+ refused with code (8|6))*"},
    {"surfaces",
     "send heaps of triangles as surfaces of a real room, in wrong order and with NaN, without end",
     &sendSurfaces, "the stream .*, refused: .*surface.*"},
    {"solve_at_the_end", "join an expensive scene, while the server gets SIGTERM", &solveAtTheEnd,
     "accepted with .*", "", Access::open, true},
};

}  // namespace

std::span<const Attack> workAttacks() {
  return kAttacksWork;
}

}  // namespace clothstream::attack
