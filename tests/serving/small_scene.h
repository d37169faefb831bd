// SPDX-License-Identifier: MIT
// Test scene that any machine simulates in real time. Its cloth and its collider move.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "server/model/input.h"
#include "server/model/scene.h"

namespace clothstream::tests {

// 12 x 10 nodes that hang by their first row, and a moving ball next to them. 40 ticks and frames per second.
inline model::Scene smallScene(std::string name = "small") {
  model::Cloth cloth;
  cloth.name = "sheet";
  cloth.grid = {.rows = 12, .columns = 10, .width = 0.9f, .height = 1.1f, .pose = {}};
  cloth.mass = 0.12f;
  cloth.structural = {5, 0.001f};
  cloth.shear = {2, 0.001f};
  cloth.bend = {0.5f, 0.001f};
  cloth.damping = 0.5f;
  cloth.drag = 0.5f;
  cloth.lift = 0.1f;
  cloth.pins = {
      {.firstRow = 0, .lastRow = 0, .rowStep = 1, .firstColumn = 0, .lastColumn = 9, .columnStep = 1}};

  model::Collider ball;
  ball.name = "ball";
  ball.shape = model::Sphere{0.2f};
  ball.motion.keys = {{0, {0, -0.5f, 0.5f}}, {1, {0, -0.5f, -0.5f}}, {2, {0, -0.5f, 0.5f}}};

  model::Scene scene;
  scene.name = std::move(name);
  scene.simulationRate = scene.streamRate = 40;
  scene.substeps = 12;
  scene.stream.qualities = 1;  // so that slow readers get the same packets
  scene.cloths = {cloth};
  scene.colliders = {ball};
  return scene;
}

inline model::ParameterChange gravity(float y) {
  model::ParameterChange change;
  change.environment[parameters::kGravity] = {0, y, 0};
  return change;
}

inline model::ParameterChange wind(float x) {
  model::ParameterChange change;
  change.environment[parameters::kWind] = {x, 0, 0};
  return change;
}

inline model::ParticipantCollider handAt(std::uint32_t id, float x, float y = 0, float z = 0) {
  model::ParticipantCollider hand;
  hand.id = id;
  hand.pose.position = model::Vec3(x, y, z);
  return hand;
}

}  // namespace clothstream::tests
