// SPDX-License-Identifier: MIT
// A scene whose ticks depend on everything that a checkpoint holds.
#pragma once

#include <cmath>
#include <cstdint>

#include "tests/serving/scene/hosted_scene.h"

namespace clothstream::tests {

// Hands hold and push the cloth, one of them with a fan, a moved rod carries one edge, and a ball and gusts
// depend on the tick.
inline model::Scene busyScene(model::SolverKind solver) {
  model::Scene scene = smallScene();
  model::Cloth& cloth = scene.cloths.front();
  cloth.solver.kind = solver;
  model::Attachment& rod = cloth.attachments.emplace_back();
  rod.name = "rod";
  rod.ranges = {{.firstRow = 3, .lastRow = 8}};
  scene.environment.gust = {.strength = 2, .seconds = 0.4f};
  scene.environment.wind = model::Vec3(1, 0, 0.5f);
  return scene;
}

// Runs one tick with its inputs, which depend on its number alone: poses, except after each tenth tick, when
// the former ones go on acting. The second grab begins after tick
// `secondGrab`, and draws a place to itself for 0.2 s. The solver changes in the tick after `otherSolver`.
inline void busyTick(HostedScene& hosted, std::uint64_t secondGrab = 100, std::uint64_t otherSolver = 190) {
  const std::uint64_t tick = hosted.host.tick();
  const auto at = [](float x, float y, float z) {
    return model::Pose{model::Vec3(x, y, z), model::Quaternion::Identity()};
  };
  const float swing = 0.1f * std::sin(static_cast<float>(tick) / 7);
  model::ParticipantPoses poses{.colliders = {handAt(1, swing, -0.6f, 0.1f)},
                                .grabs = {{.id = 1, .pose = at(0.2f + swing, -0.9f, swing), .radius = 0.25f}},
                                .winds = {{{.pose = at(0, -0.9f, -0.2f), .speed = 4}, 1}},
                                .attachments = {{.attachment = 0, .pose = at(-swing, 0, 0)}}};
  if (tick > secondGrab) {
    const model::GrabPlace place{.point = {.cloth = 0, .triangle = 150, .second = 0.2f, .third = 0.3f}};
    poses.grabs.push_back({.id = 2, .pose = at(-0.2f, -0.8f, swing), .radius = 0.2f, .place = place});
  }
  if (tick == 0 || tick % 10 != 0) hosted.live.inbox.postPoses(7, poses, hosted.now);
  if (tick == otherSolver) {
    model::Solver other;
    other.kind = hosted.live.start().cloths.front().solver.kind == model::SolverKind::xpbd
                     ? model::SolverKind::constraint
                     : model::SolverKind::xpbd;
    hosted.change({.cloths = {{.name = "sheet", .solver = other}}});
  }
  hosted.tick();
}

}  // namespace clothstream::tests
