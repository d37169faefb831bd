// SPDX-License-Identifier: MIT
#include "tests/contact/watched_contact.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "clients/core/touch/contact.h"
#include "server/messages/hands.h"
#include "server/model/mesh.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

using client::OwnCapsules;
using client::Vector;
using client::vectorAt;
using model::Vec3;

constexpr double kTickSeconds = 1.0 / 72, kDisplaySeconds = 1.0 / 90;
const Vec3 kMiddle(0, -0.5f, 0);
const Vec3 kUp = Vec3::UnitY(), kAside = Vec3::UnitX(), kAhead = Vec3::UnitZ();

std::vector<model::ParticipantCollider> bonesOf(const HandJoints& joints) {
  v1::HandJoints message;
  message.set_side(v1::HAND_SIDE_RIGHT);
  for (std::size_t i = 0; i < joints.size(); i += 4) {
    for (std::size_t axis = 0; axis < 3; ++axis) message.add_positions(joints[i + axis]);
    message.add_radii(joints[i + 3]);
  }
  messages::Checks checks;
  std::vector<model::ParticipantCollider> bones = messages::toBones(checks, messages::Path("hand"), message);
  EXPECT_FALSE(checks.failed());
  return bones;
}

OwnCapsules capsulesOf(const HandJoints& joints) {
  client::Poses poses;
  poses.rightHand.assign(joints.begin(), joints.end());
  return client::ownCapsules(poses);
}

// 200 g/m^2, pinned at the upper edge, 1 cm from node to node: no finger fits between the nodes.
model::Scene curtain() {
  model::Scene scene = sceneOf({calmCloth(81, 81)});
  model::Cloth& cloth = scene.cloths[0];
  cloth.grid.width = cloth.grid.height = 0.8f;
  cloth.mass = 0.128f;
  cloth.structural = {2000, 0};
  cloth.shear = {300, 0};
  cloth.bend = {1, 0};
  cloth.damping = 1;
  cloth.solver.kind = model::SolverKind::xpbd;
  cloth.solver.iterations = 1;
  cloth.pins = {topRow(cloth)};
  cloth.thickness = 0.006f;
  scene.substeps = 40;
  return scene;
}

// Positions after each tick; the first ones are the start.
using States = std::vector<std::vector<float>>;

States simulate(const model::Scene& scene, const HandScript& hand, double uplinkSeconds, int ticks) {
  Running running(scene);
  States states;
  const auto keep = [&] {
    std::vector<float>& numbers = states.emplace_back();
    for (const Vec3& position : running.state().positions)
      numbers.insert(numbers.end(), position.data(), position.data() + 3);
  };
  simulation::TickInputs inputs = inputsOf(scene);
  running.tick(inputs);
  keep();
  for (int tick = 1; tick <= ticks; ++tick) {
    const auto before = bonesOf(hand((tick - 1) * kTickSeconds - uplinkSeconds));
    const auto after = bonesOf(hand(tick * kTickSeconds - uplinkSeconds));
    inputs.colliders.clear();
    for (std::size_t i = 0; i < before.size(); ++i)
      inputs.colliders.push_back({after[i].shape, before[i].pose, after[i].pose, 0.5f});
    EXPECT_TRUE(running.tick(inputs).healthy);
    keep();
  }
  return states;
}

std::vector<float> stateAt(const States& states, double seconds) {
  const double ticks = std::clamp(seconds / kTickSeconds, 0.0, static_cast<double>(states.size() - 1));
  const auto tick = std::min(static_cast<std::size_t>(ticks), states.size() - 2);
  const auto part = static_cast<float>(ticks - static_cast<double>(tick));
  std::vector<float> state = states[tick];
  for (std::size_t i = 0; i < state.size(); ++i) state[i] += part * (states[tick + 1][i] - state[i]);
  return state;
}

// Largest depth of 66 points on each triangle, in a lattice, below the surface of the capsules. The points of
// a triangle with edges of up to 2 cm are at most 2 mm apart: with a capsule of 8 mm the result is at most
// 0.1 mm too small.
double depthOf(const std::vector<model::Triangle>& triangles, std::span<const float> positions,
               const OwnCapsules& capsules) {
  double deepest = 0;
  for (const model::Triangle& triangle : triangles) {
    const Vector a = vectorAt(positions.data(), triangle[0]);
    const Vector ab = vectorAt(positions.data(), triangle[1]) - a;
    const Vector ac = vectorAt(positions.data(), triangle[2]) - a;
    const float size = std::max(client::length(ab), client::length(ac));
    for (const client::Capsule& capsule : capsules) {
      const Vector along = capsule.to - capsule.from;
      const float reach = capsule.radius + client::length(along) + size;
      if (!capsule.present() || client::length(a - capsule.from) > reach) continue;
      const float squared = client::dot(along, along);
      for (int i = 0; i <= 10; ++i)
        for (int j = 0; i + j <= 10; ++j) {
          const Vector point = a + (static_cast<float>(i) / 10) * ab + (static_cast<float>(j) / 10) * ac;
          const float part = std::clamp(client::dot(along, point - capsule.from) / squared, 0.0f, 1.0f);
          deepest = std::max(deepest, double{capsule.radius - client::length(point - capsule.at(part))});
        }
    }
  }
  return deepest;
}

// Longest way of a joint.
double travel(const HandJoints& from, const HandJoints& to) {
  double longest = 0;
  for (std::size_t i = 0; i < from.size(); i += 4)
    longest = std::max(longest, double{client::length(vectorAt(&to[i], 0) - vectorAt(&from[i], 0))});
  return longest;
}

// From 0.3 m in front of the cloth to 0.3 m behind it.
float through(double time, double seconds) {
  return static_cast<float>(-0.3 + 0.6 * smoothWay(time - 0.2, seconds));
}

}  // namespace

Motion flatHandAt(double speed) {
  const double seconds = kPeakSpeed * 0.6 / speed;
  return {fmt::format("flat hand, {} m/s", speed),
          [=](double time) { return flatHand(kMiddle + through(time, seconds) * kAhead, kUp, kAside); },
          seconds + 1};
}

Motion fingersAt(double speed) {
  const double seconds = kPeakSpeed * 0.6 / speed;
  return {fmt::format("fingertips, {} m/s", speed),
          [=](double time) {
            return flatHand(kMiddle + (through(time, seconds) - 0.12f) * kAhead, kAhead, kAside);
          },
          seconds + 1};
}

Motion inAndOut() {
  return {"in and out, 1 m/s",
          [](double time) {
            const double turn = std::clamp(time - 0.2, 0.0, 2.5) * 2 * std::numbers::pi / 1.25;
            return flatHand(kMiddle - static_cast<float>(0.2 * std::cos(turn)) * kAhead, kUp, kAside);
          },
          3.5};
}

Motion stroke() {
  return {"stroke, 1 m/s",
          [](double time) {
            const auto in = static_cast<float>(smoothWay(time - 0.2, 0.5));
            const auto along = static_cast<float>(smoothWay(time - 0.8, 0.75));
            return flatHand(kMiddle + (0.4f * along - 0.2f) * kAside + (0.13f * in - 0.1f) * kAhead, kUp,
                            kAside);
          },
          2.5};
}

std::vector<Motion> allMotions() {
  std::vector<Motion> all;
  for (const double speed : {0.5, 1.0, 2.0}) {
    all.push_back(flatHandAt(speed));
    all.push_back(fingersAt(speed));
  }
  all.push_back(inAndOut());
  all.push_back(stroke());
  return all;
}

ContactFigures watch(const Motion& motion, double roundTripSeconds) {
  const model::Scene scene = curtain();
  const std::vector<model::Triangle> triangles = model::clothTriangles(scene.cloths[0]);
  const double uplink = roundTripSeconds / 2, delay = roundTripSeconds / 2 + 1.5 * kTickSeconds;
  const States states =
      simulate(scene, motion.hand, uplink, static_cast<int>(motion.seconds / kTickSeconds) + 2);
  client::Description description;
  for (const Vec3& position : model::restPositions(scene.cloths[0]))
    description.restPositions.insert(description.restPositions.end(), position.data(), position.data() + 3);
  for (const model::Triangle& triangle : triangles)
    description.triangles.insert(description.triangles.end(), triangle.begin(), triangle.end());
  client::Contact contact;
  contact.begin(description);

  ContactFigures figures;
  for (std::size_t tick = 0; tick < states.size(); ++tick)
    figures.deepestOnServer =
        std::max(figures.deepestOnServer,
                 depthOf(triangles, states[tick],
                         capsulesOf(motion.hand(static_cast<double>(tick) * kTickSeconds - uplink))));
  std::vector<Vector> corrections(scene.nodeCount());
  for (int frame = 0; frame * kDisplaySeconds < motion.seconds; ++frame) {
    const double now = frame * kDisplaySeconds, answered = now - delay - uplink;
    const std::vector<float> played = stateAt(states, now - delay);
    const OwnCapsules newest = capsulesOf(motion.hand(now));
    const std::span<const float> shown = contact.apply(played, capsulesOf(motion.hand(answered)), newest,
                                                       1'000'000 + static_cast<std::uint64_t>(1e6 * now));
    figures.deepest = std::max(figures.deepest, depthOf(triangles, shown, newest));
    figures.deepestWithout = std::max(figures.deepestWithout, depthOf(triangles, played, newest));
    const double way = travel(motion.hand(now - kDisplaySeconds), motion.hand(now));
    const double answeredWay = travel(motion.hand(answered - kDisplaySeconds), motion.hand(answered));
    figures.left = 0;
    for (std::size_t i = 0; i < corrections.size(); ++i) {
      const Vector correction = vectorAt(shown.data(), i) - vectorAt(played.data(), i);
      const double change = double{client::length(correction - corrections[i])};
      figures.change = std::max(figures.change, change - way);
      figures.changeBesidesAnswer =
          std::max(figures.changeBesidesAnswer, change - std::max(way, answeredWay));
      figures.left = std::max(figures.left, double{client::length(correction)});
      corrections[i] = correction;
    }
    figures.largest = std::max(figures.largest, figures.left);
  }
  return figures;
}

}  // namespace clothstream::tests
