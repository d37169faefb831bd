// SPDX-License-Identifier: MIT
// Coulomb friction at colliders, for every shape: on slopes, under pressure, around a cylinder.
// docs/mechanics.md has the figures.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/mechanics/rows.h"
#include "tests/simulation/scenes.h"

namespace clothstream::mechanics {
namespace {

using model::Vec3;
using simulation::MovingCollider;
using simulation::NodeState;
using tests::Running;

constexpr double kGravity = 9.81;
constexpr float kFriction = 0.5f;

class ContactLaws : public tests::GpuTest {};

struct NamedShape {
  std::string name;
  model::Shape shape;  // its upper side is flat and 0.5 m above its centre, or the plane
  float above;
};

std::vector<NamedShape> flatShapes() {
  return {{"plane", model::Plane{}, 0},
          {"box", model::Box{Vec3(8, 1, 8)}, 0.5f},
          {"triangle mesh", model::boxMesh(Vec3(8, 1, 8)), 0.5f}};
}

model::Pose at(const Vec3& position) {
  return {position, model::Quaternion::Identity()};
}

MovingCollider still(const model::Shape& shape, const Vec3& position) {
  return {shape, at(position), at(position), 1};
}

// A sheet of loose nodes that lies on the shape.
model::Scene sheetOn(const NamedShape& shape, double slope) {
  model::Cloth cloth = tests::looseCloth(4, 4);
  cloth.grid.pose = {Vec3(0, shape.above + 0.004f, 0), tests::turned(-90, Vec3::UnitX())};
  cloth.friction = kFriction;
  model::Scene scene = tests::sceneOf({cloth});
  scene.colliders = {{.name = "ground", .shape = shape.shape}};
  // Gravity leans instead of the ground.
  scene.environment.gravity = Vec3(static_cast<float>(kGravity * std::sin(slope)),
                                   static_cast<float>(-kGravity * std::cos(slope)), 0);
  return scene;
}

// Metres that the sheet moves along the slope in a second.
double wayOnSlope(const NamedShape& shape, double slope) {
  const model::Scene scene = sheetOn(shape, slope);
  Running running(scene);
  const Vec3 start = running.state().positions[5];
  for (int tick = 0; tick < 72; ++tick)
    running.tick(tests::inputsOf(scene, {still(shape.shape, Vec3::Zero())}));
  return double{(running.state().positions[5] - start).x()};
}

// A slide in n substeps of h covers a h^2 n (n + 1) / 2 with a = g (sin - mu cos). On a slope 2 % below the
// angle of friction, nothing moves.
TEST_F(ContactLaws, ASheetSlidesFromTheAngleOfFriction) {
  const double angle = std::atan(double{kFriction}), h = 1.0 / 720;
  for (const NamedShape& shape : flatShapes()) {
    SCOPED_TRACE(shape.name);
    const double held = wayOnSlope(shape, 0.98 * angle), slope = 1.5 * angle;
    const double acceleration = wayOnSlope(shape, slope) / (h * h * 720 * 721 / 2);
    const double friction = (kGravity * std::sin(slope) - acceleration) / (kGravity * std::cos(slope));
    EXPECT_LT(std::abs(held), 1e-5);
    EXPECT_GT(wayOnSlope(shape, 1.02 * angle), 0.01);
    EXPECT_NEAR(friction, kFriction, 0.02 * kFriction);
    expectRow({"friction of a slide, " + shape.name, "0.5", "2 %", fmt::format("{:.4f}", friction)});
    expectRow({"way on a slope below atan(0.5), " + shape.name + ", m", "0", "1e-5", figure(std::abs(held))});
  }
}

// Loose nodes in a groove of two planes at 45 degrees: each carries 1 / sqrt(2) of the weight. Metres that
// they move along it in a second.
double wayInAGroove(double slope) {
  model::Cloth cloth = tests::looseCloth(2, 4);
  cloth.grid.height = 0.0001f;
  cloth.grid.pose.position.y() = 0.004f * std::numbers::sqrt2_v<float>;
  cloth.friction = kFriction;
  model::Scene scene = tests::sceneOf({cloth});
  scene.environment.gravity = Vec3(static_cast<float>(kGravity * std::sin(slope)),
                                   static_cast<float>(-kGravity * std::cos(slope)), 0);
  std::vector<MovingCollider> sides;
  for (const float degrees : {45.0f, -45.0f}) {
    const model::Pose side{Vec3::Zero(), tests::turned(degrees, Vec3::UnitX())};
    sides.push_back({model::Plane{}, side, side, 1});
  }
  Running running(scene);
  const Vec3 start = running.state().positions[1];
  for (int tick = 0; tick < 72; ++tick) running.tick(tests::inputsOf(scene, sides));
  return double{(running.state().positions[1] - start).x()};
}

TEST_F(ContactLaws, ASheetSlidesInAGroove) {
  const double exact = double{kFriction} * std::numbers::sqrt2, angle = std::atan(exact), h = 1.0 / 720;
  const double held = wayInAGroove(0.98 * angle), slope = 1.3 * angle;
  const double acceleration = wayInAGroove(slope) / (h * h * 720 * 721 / 2);
  const double friction = (kGravity * std::sin(slope) - acceleration) / (kGravity * std::cos(slope));
  EXPECT_LT(std::abs(held), 1e-5);
  EXPECT_NEAR(friction, exact, 0.02 * exact);
  expectRow({"friction of a slide in a groove", fmt::format("{:.4f}", exact), "2 %",
             fmt::format("{:.4f}", friction)});
  expectRow({"way in a groove below its angle of friction, m", "0", "1e-5", figure(std::abs(held))});
}

// 20 g, 20 cm x 50 cm, of cotton.
model::Scene towel(model::SolverKind solver) {
  model::Cloth cloth;
  cloth.name = "towel";
  cloth.grid = {.rows = 11, .columns = 5, .width = 0.2f, .height = 0.5f, .pose = {}};
  cloth.mass = 0.02f;
  cloth.solver.kind = solver;
  const float stiffness = solver == model::SolverKind::massSpring ? 30.0f : 1500.0f;
  cloth.structural = {stiffness, 0.002f};
  cloth.shear = {stiffness / 10, 0.001f};
  cloth.bend = {0.02f, 0.0001f};
  cloth.damping = 0.5f;
  cloth.friction = 1;
  model::Scene scene = tests::sceneOf({cloth});
  return scene;
}

// Mean of the nodes of one of the scene's equal cloths.
double lowered(const model::Scene& scene, const NodeState& start, const NodeState& end, std::size_t cloth) {
  const std::size_t nodes = start.positions.size() / scene.cloths.size();
  double sum = 0;
  for (std::size_t i = cloth * nodes; i < (cloth + 1) * nodes; ++i)
    sum += double{start.positions[i].y() - end.positions[i].y()};
  return sum / static_cast<double>(nodes);
}

// Two shapes close on a towel to 4 mm of interference. A normal force above W / (2 mu) = 0.1 N holds its
// weight. After a quarter of a second they rise by 30 cm in a second, and the towel with them.
double slipInAPinch(model::Scene scene, const model::Shape& shape, float half, float friction,
                    std::size_t cloth = 0) {
  scene.colliders = {{.name = "thumb", .shape = shape}, {.name = "finger", .shape = shape}};
  Running running(scene);
  const NodeState start = running.state();
  const auto places = [&](int tick) {
    const float t = static_cast<float>(tick) / 72;
    const float apart = half - 0.002f + std::max(0.0f, 0.006f * (1 - 20 * t));
    const float y = -0.05f + 0.3f * std::clamp(t - 0.25f, 0.0f, 1.0f);
    return std::pair(Vec3(0, y, -apart), Vec3(0, y, apart));
  };
  for (int tick = 0; tick < 90; ++tick) {
    const auto [behind, before] = places(tick);
    const auto [nextBehind, nextBefore] = places(tick + 1);
    EXPECT_TRUE(running
                    .tick(tests::inputsOf(scene, {{shape, at(behind), at(nextBehind), friction},
                                                  {shape, at(before), at(nextBefore), friction}}))
                    .healthy);
  }
  return lowered(scene, start, running.state(), cloth) + 0.3;
}

TEST_F(ContactLaws, APinchLiftsATowel) {
  const std::vector<std::pair<std::string, model::Shape>> shapes{
      {"boxes", model::Box{Vec3(0.3f, 0.06f, 0.05f)}},
      {"capsules", model::Capsule{.radius = 0.025f, .length = 0.3f}},
      {"spheres", model::Sphere{0.025f}},
      {"triangle meshes", model::boxMesh(Vec3(0.3f, 0.06f, 0.05f))}};
  for (const auto& [name, shape] : shapes) {
    SCOPED_TRACE(name);
    const double slip = slipInAPinch(towel(model::SolverKind::xpbd), shape, 0.025f, 1);
    EXPECT_LT(std::abs(slip), 0.05);
    expectRow(
        {"slip of a towel that two " + name + " pinch and lift, m", "0", "0.05", figure(std::abs(slip))});
  }
  const model::Shape fingers = model::Sphere{0.025f};
  const double byForces = slipInAPinch(towel(model::SolverKind::massSpring), fingers, 0.025f, 1);
  EXPECT_LT(std::abs(byForces), 0.05);
  expectRow({"slip of a towel that two spheres pinch and lift, `massSpring`, m", "0", "0.05",
             figure(std::abs(byForces))});
  EXPECT_GT(slipInAPinch(towel(model::SolverKind::xpbd), fingers, 0.025f, 0), 2) << "without friction";
}

// Three towels, whose balls touch. Boxes pinch the outer ones, and only friction between cloths lifts the one
// in the middle.
TEST_F(ContactLaws, APinchLiftsThreeTowels) {
  const auto slipOfTheMiddle = [](float friction) {
    constexpr float kRadius = 0.01f;
    model::Scene scene = towel(model::SolverKind::xpbd);
    scene.cloths.resize(3, scene.cloths[0]);
    for (std::size_t i = 0; i < 3; ++i) {
      scene.cloths[i].name += std::to_string(i);
      scene.cloths[i].selfCollision = model::SelfCollision{.radius = kRadius, .friction = friction};
      scene.cloths[i].grid.pose.position.z() = 2 * kRadius * (static_cast<float>(i) - 1);
    }
    return slipInAPinch(scene, model::Box{Vec3(0.3f, 0.06f, 0.05f)}, 0.025f + 2 * kRadius, 1, 1);
  };
  const double slip = slipOfTheMiddle(1);
  EXPECT_LT(std::abs(slip), 0.05);
  EXPECT_GT(slipOfTheMiddle(0), 1) << "without friction";
  expectRow({"slip of a towel between two others that two boxes pinch and lift, m", "0", "0.05",
             figure(std::abs(slip))});
}

// A third of it hangs over the edge of a table. A plate can only add friction.
TEST_F(ContactLaws, PressedClothStaysOnATable) {
  for (const bool pressed : {false, true}) {
    model::Scene scene = towel(model::SolverKind::xpbd);
    scene.cloths[0].grid.pose = {Vec3(-0.35f, 0.005f, 0),
                                 tests::turned(90, Vec3::UnitX()) * tests::turned(90, Vec3::UnitZ())};
    std::vector<MovingCollider> colliders{still(model::Box{Vec3(1, 1, 1)}, Vec3(-0.53f, -0.5f, 0))};
    if (pressed) colliders.push_back(still(model::Box{Vec3(0.15f, 0.05f, 0.6f)}, Vec3(-0.15f, 0.027f, 0)));
    Running running(scene);
    const NodeState start = running.state();
    for (int tick = 0; tick < 144; ++tick) running.tick(tests::inputsOf(scene, colliders));
    const double way = double{(running.state().positions[2] - start.positions[2]).norm()};
    EXPECT_LT(way, 0.05);
    expectRow({std::string("way of cloth on a table, a third of it over the edge") +
                   (pressed ? ", pressed by a plate" : "") + ", m",
               "0", "0.05", figure(way)});
  }
}

// A strip of two rows of nodes, half around a cylinder along Z.
constexpr std::uint32_t kRows = 61;
constexpr float kRadius = 0.1f;

model::Cloth wrappedStrip() {
  constexpr float kStraight = 0.3f, kPi = std::numbers::pi_v<float>;
  constexpr float kLength = 2 * kStraight + kPi * kRadius;
  const auto place = [&](float along, float z) -> Vec3 {
    if (along < kStraight) return {-kRadius, along - kStraight, z};
    if (along > kLength - kStraight) return {kRadius, kLength - kStraight - along, z};
    const float angle = kPi - (along - kStraight) / kRadius;
    return {kRadius * std::cos(angle), kRadius * std::sin(angle), z};
  };
  model::MeshShape shape = model::shapeOf(model::grid(kRows, 2));
  for (std::uint32_t row = 0; row < kRows; ++row)
    for (std::uint32_t column = 0; column < 2; ++column)
      shape.positions[2 * row + column] =
          place(kLength * static_cast<float>(row) / (kRows - 1), 0.02f * static_cast<float>(column));
  model::Cloth cloth;
  cloth.name = "strip";
  cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(shape));
  cloth.mass = 0.01f;
  cloth.structural = {500, 0.02f};
  cloth.damping = cloth.drag = cloth.lift = 0;
  cloth.friction = kFriction;
  cloth.thickness = 0;
  cloth.solver.kind = model::SolverKind::xpbd;
  for (const std::uint32_t row : {0u, kRows - 1}) {
    model::Attachment end;
    end.name = row == 0 ? "in" : "out";
    end.vertices = {2 * row, 2 * row + 1};
    cloth.attachments.push_back(end);
  }
  return cloth;
}

// Without gravity. One end is drawn by 2 mm, then both with one speed, so that the strip is under tension and
// slides everywhere: T1 / T2 = exp(mu pi) (Euler, "Remarques sur l'effet du frottement dans l'équilibre",
// 1762).
TEST_F(ContactLaws, TensionAroundACylinderGrowsAsTheCapstanEquationSays) {
  const model::Cloth cloth = wrappedStrip();
  model::Scene scene = tests::sceneOf({cloth});
  scene.substeps = 20;
  scene.environment.gravity = Vec3::Zero();
  Running running(scene);
  const NodeState start = running.state();
  const model::Shape cylinder = model::Capsule{.radius = kRadius, .length = 1};
  const model::Pose across{Vec3::Zero(), tests::turned(90, Vec3::UnitX())};
  constexpr int kTicks = 216;  // until the tensions are steady
  for (int tick = 0; tick < kTicks; ++tick) {
    simulation::TickInputs inputs = tests::inputsOf(scene, {{cylinder, across, across, 1}});
    const float drawn = 0.1f * static_cast<float>(tick + 1) / kTicks;
    inputs.attachments = {at(Vec3(0, drawn, 0)), at(Vec3(0, -drawn - 0.002f, 0))};
    running.tick(inputs);
  }
  const NodeState end = running.state();
  const auto tension = [&](std::uint32_t row) {
    const auto lengthIn = [&](const NodeState& state) {
      return double{(state.positions[2 * row + 2] - state.positions[2 * row]).norm()};
    };
    return lengthIn(end) - lengthIn(start);
  };
  double before = 0, behind = 0;
  for (std::uint32_t i = 1; i < 5; ++i) {
    before += tension(i);
    behind += tension(kRows - 2 - i);
  }
  const double ratio = behind / before, exact = std::exp(double{kFriction} * std::numbers::pi);
  EXPECT_NEAR(ratio, exact, 0.05 * exact);
  expectRow({"tension of a strip behind a cylinder over that before it", fmt::format("{:.3f}", exact), "5 %",
             fmt::format("{:.3f}", ratio)});
}

}  // namespace
}  // namespace clothstream::mechanics
