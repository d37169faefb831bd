// SPDX-License-Identifier: MIT
// Scenes in which cloth is pressed, struck and crumpled so hard that balls alone let it pass through itself.
#include "tests/simulation/stress_scenes.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "server/simulation/scene_tables.h"
#include "tests/model/meshes.h"

namespace clothstream::tests {
namespace {

using simulation::MovingCollider;

constexpr float kTick = 1.0f / 72;  // s
constexpr float kSpacing = 0.02f;   // m
constexpr float kFast = 5;          // m/s

model::Cloth stressCloth(std::uint32_t rows, std::uint32_t columns, bool nothingPasses) {
  model::Cloth cloth;
  cloth.name = "cloth";
  cloth.grid = {.rows = rows,
                .columns = columns,
                .width = kSpacing * static_cast<float>(columns - 1),
                .height = kSpacing * static_cast<float>(rows - 1),
                .pose = {}};
  cloth.mass = 0.01f * static_cast<float>(rows * columns);
  cloth.structural = {100, 0.1f};
  cloth.shear = {50, 0.05f};
  cloth.bend = {1, 0.01f};
  cloth.damping = 0.5f;
  cloth.selfCollision =
      model::SelfCollision{.radius = kSpacing / 2, .friction = 0.3f, .nothingPasses = nothingPasses};
  return cloth;
}

model::Scene sceneOf(const char* name, std::vector<model::Cloth> cloths) {
  model::Scene scene;
  scene.name = name;
  scene.cloths = std::move(cloths);
  return scene;
}

model::Quaternion turned(float degrees, const model::Vec3& axis) {
  return model::Quaternion(Eigen::AngleAxisf(degrees * std::acos(-1.0f) / 180, axis.normalized()));
}

model::Pose at(const model::Vec3& position, const model::Quaternion& turn = model::Quaternion::Identity()) {
  return {position, turn};
}

// A collider with this position at the start of each tick.
template <typename Place>
MovingCollider moving(model::Shape shape, const Place& place, int tick,
                      const model::Quaternion& turn = model::Quaternion::Identity()) {
  return {std::move(shape), at(place(tick), turn), at(place(tick + 1), turn), 0.5f};
}

MovingCollider ground(float y) {
  return {model::Plane{}, at({0, y, 0}), at({0, y, 0}), 0.5f};
}

// Goes to and fro between -amplitude and amplitude at constant speed.
float swing(int tick, float amplitude, float speed) {
  const float way = std::fmod(speed * kTick * static_cast<float>(tick), 4 * amplitude);
  return way < 2 * amplitude ? way - amplitude : 3 * amplitude - way;
}

// Approaches `end` from `start` at a speed, then stays.
float approach(int tick, float start, float end, float speed) {
  const float way = speed * kTick * static_cast<float>(tick);
  return start < end ? std::min(start + way, end) : std::max(start - way, end);
}

// A hand of 20 cm strikes two curtains, one behind the other, to and fro at 5 m/s.
StressScene fastHand(bool nothingPasses) {
  model::Cloth front = stressCloth(36, 36, nothingPasses), back = front;
  front.name = "front";
  back.name = "back";
  front.pins = back.pins = {{.firstRow = 0,
                             .lastRow = 0,
                             .rowStep = 1,
                             .firstColumn = 0,
                             .lastColumn = front.grid.columns - 1,
                             .columnStep = 1}};
  back.grid.pose.position.z() = -0.03f;
  StressScene stress{sceneOf("fast hand", {front, back}), {}, {}, 144};
  stress.start = simulation::restState(stress.scene.cloths);
  stress.colliders = [](int tick) {
    const auto place = [](int t) {
      return model::Vec3(swing(t, 0.25f, 1.3f), -0.45f, swing(t, 0.5f, kFast));
    };
    return std::vector{moving(model::Capsule{.radius = 0.05f, .length = 0.1f}, place, tick,
                              turned(60, model::Vec3::UnitZ()))};
  };
  return stress;
}

// Five folds of thin cloth between two plates, which close to the room of five layers and then shear them.
StressScene pressedFolds(bool nothingPasses) {
  constexpr float kRadius = 0.3f * kSpacing, kRoom = 5 * 2 * kRadius + 0.01f;
  model::Cloth cloth = stressCloth(60, 20, nothingPasses);
  cloth.selfCollision->radius = kRadius;
  StressScene stress{sceneOf("pressed folds", {cloth}), {}, {}, 144};
  stress.start = simulation::restState(stress.scene.cloths);
  for (std::uint32_t row = 0; row < 60; ++row)
    for (std::uint32_t column = 0; column < 20; ++column) {
      const std::uint32_t fold = row / 12, along = row % 12;
      model::Vec3& p = stress.start.positions[row * 20 + column];
      p.y() = 0.02f + 0.022f * static_cast<float>(fold);
      p.z() = kSpacing * static_cast<float>(fold % 2 == 0 ? along : 11 - along);
    }
  stress.colliders = [](int tick) {
    const model::Box plate{model::Vec3(1, 0.2f, 1)};
    const auto above = [](int t) {
      const float shear = t < 72 ? 0 : 0.1f * std::sin(0.2f * static_cast<float>(t - 72));
      return model::Vec3(shear, approach(t, 0.3f, 0.1f + kRoom, 2), 0);
    };
    return std::vector{ground(0), moving(plate, above, tick)};
  };
  return stress;
}

// A standing sheet is pushed together from four sides and from above.
StressScene crumpledPile(bool nothingPasses) {
  model::Cloth cloth = stressCloth(40, 40, nothingPasses);
  cloth.grid.pose = {model::Vec3(0, 0.82f, 0), turned(7, model::Vec3(1, 0.3f, 0.2f).normalized())};
  StressScene stress{sceneOf("crumpled pile", {cloth}), {}, {}, 180};
  stress.start = simulation::restState(stress.scene.cloths);
  stress.colliders = [](int tick) {
    std::vector colliders{ground(0)};
    for (const float side : {-1.0f, 1.0f}) {
      colliders.push_back(moving(
          model::Box{model::Vec3(0.2f, 2, 2)},
          [&](int t) { return model::Vec3(side * approach(t, 0.6f, 0.22f, 0.4f), 1, 0); }, tick));
      colliders.push_back(moving(
          model::Box{model::Vec3(2, 2, 0.2f)},
          [&](int t) { return model::Vec3(0, 1, side * approach(t, 0.6f, 0.22f, 0.4f)); }, tick));
    }
    colliders.push_back(moving(
        model::Box{model::Vec3(2, 0.2f, 2)},
        [](int t) { return model::Vec3(0, approach(std::max(t - 60, 0), 1.2f, 0.35f, 1), 0); }, tick));
    return colliders;
  };
  return stress;
}

// Two sheets fly into each other at 8 m/s, edges first across each other; then they fall on the ground.
StressScene thrownSheets(bool nothingPasses) {
  model::Cloth one = stressCloth(30, 30, nothingPasses), other = one;
  one.grid.pose = {model::Vec3(0, 1, 0.1f), turned(20, model::Vec3::UnitY())};
  other.grid.pose = {model::Vec3(0.1f, 1.1f, -0.15f), turned(35, model::Vec3::UnitZ())};
  StressScene stress{sceneOf("thrown sheets", {one, other}), {}, {}, 108};
  stress.start = simulation::restState(stress.scene.cloths);
  for (std::size_t i = 0; i < stress.start.velocities.size(); ++i)
    stress.start.velocities[i] = model::Vec3(0, 1, i < 900 ? -4.0f : 4.0f);
  stress.colliders = [](int) { return std::vector{ground(0.3f)}; };
  return stress;
}

// Three discs fall on each other, by XPBD, and a box strikes the heap at 5 m/s from both sides in turn.
StressScene struckHeap(bool nothingPasses) {
  std::vector<model::Cloth> cloths;
  for (int i = 0; i < 3; ++i) {
    model::Cloth cloth = stressCloth(2, 2, nothingPasses);
    cloth.name = "disc" + std::to_string(i);
    cloth.mesh = std::make_shared<const model::Mesh>(model::makeMesh(model::disc(8, 8 * kSpacing)));
    cloth.mass = 0.02f * static_cast<float>(cloth.nodeCount());
    cloth.structural = {200, 0.2f};
    cloth.shear = {100, 0.1f};
    cloth.selfCollision->radius = 0.4f * kSpacing;
    cloth.solver.kind = model::SolverKind::xpbd;
    cloths.push_back(cloth);
  }
  StressScene stress{sceneOf("struck heap", cloths), {}, {}, 144};
  stress.start = simulation::restState(stress.scene.cloths);
  const std::size_t nodes = stress.start.positions.size() / 3;
  for (std::size_t i = 0; i < stress.start.positions.size(); ++i) {
    const auto disc = static_cast<float>(i / nodes);
    const model::Vec3 turnedPosition = turned(6 + 9 * disc, model::Vec3::UnitX()) * stress.start.positions[i];
    stress.start.positions[i] = turnedPosition + model::Vec3(0.03f * disc, 0.2f + 0.09f * disc, 0);
  }
  stress.colliders = [](int tick) {
    const auto place = [](int t) { return model::Vec3(swing(t, 0.6f, kFast), 0.11f, 0.03f); };
    return std::vector{ground(0), moving(model::Box{model::Vec3(0.1f, 0.1f, 0.3f)}, place, tick,
                                         turned(25, model::Vec3::UnitY()))};
  };
  return stress;
}

}  // namespace

std::vector<StressScene> stressScenes(bool nothingPasses) {
  std::vector<StressScene> scenes;
  scenes.push_back(fastHand(nothingPasses));
  scenes.push_back(pressedFolds(nothingPasses));
  scenes.push_back(crumpledPile(nothingPasses));
  scenes.push_back(thrownSheets(nothingPasses));
  scenes.push_back(struckHeap(nothingPasses));
  return scenes;
}

}  // namespace clothstream::tests
