// SPDX-License-Identifier: MIT
// The T-shirt of the scene "walker" stays on the avatar, and outside of it.
#include <algorithm>

#include <gtest/gtest.h>

#include "server/messages/scene_file.h"
#include "server/reference/solid.h"
#include "tests/simulation/scenes.h"

namespace clothstream::tests {
namespace {

class Walker : public GpuTest {};

// Nodes end every substep at least their thickness from the nearest triangle, apart from rounding. The avatar
// is 1.3 m around the origin, and 1.8 m high: positions have an error of 2e-7 m, and distances of five times
// that. A contact moves a node away from the nearest triangle only; in the fold of a joint another one may be
// nearer then. The node is at most as deep in its thickness as it was pushed.
TEST_F(Walker, TheShirtStaysOnTheAvatarAndOutside) {
  const model::Scene scene = *messages::loadScene("walker");
  const float thickness = scene.cloths[0].thickness;
  Running running(scene);
  double nearest = 1, strain = 0;
  for (std::uint64_t tick = 0; tick < 5 * 72; ++tick) {
    const simulation::TickInputs inputs = simulation::inputsAt(scene, tick);
    const std::vector<simulation::ClothReport> reports = running.tickAndReport(inputs);
    ASSERT_EQ(reports[0].penetration, 0) << "tick " << tick;
    strain = std::max(strain, double{reports[0].strainP99});
    if (tick % 36 != 35) continue;
    const simulation::MovingCollider& avatar = inputs.colliders[0];
    const model::ClosedMesh body =
        reference::moved(*std::get<model::Solid>(avatar.shape), avatar.jointsEnd, avatar.jointsEnd, 1);
    const reference::Pose pose = reference::toPose(avatar.end);
    double height = 0;
    const std::vector<model::Vec3> positions = running.state().positions;
    for (const model::Vec3& position : positions) {
      const reference::Vec3 p = pose.orientation.conjugate() * (position.cast<double>() - pose.position);
      nearest = std::min(nearest, reference::nearestOn(body, p).distance);
      height += p.y() / static_cast<double>(positions.size());
      EXPECT_LT(std::hypot(p.x(), p.z()), 0.8) << "tick " << tick;
    }
    EXPECT_NEAR(height, 1.18, 0.08) << "tick " << tick;
  }
  RecordProperty("nearest_micrometres", static_cast<int>(1e6 * nearest));
  EXPECT_GT(nearest, thickness / 2.0);
  EXPECT_LT(strain, 0.2);
}

}  // namespace
}  // namespace clothstream::tests
