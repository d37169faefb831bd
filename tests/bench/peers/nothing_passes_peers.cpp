// SPDX-License-Identifier: MIT
// Stress scenes: self-collision by balls, the same with nothingPasses, and Bullet, with the intersections
// that each leaves.
#include <algorithm>
#include <string>

#include "server/simulation/software_threads.h"
#include "tests/bench/peers/bullet_stress.h"
#include "tests/bench/peers/peers.h"
#include "tests/bench/samples.h"
#include "tests/bench/simulated.h"
#include "tests/simulation/intersections.h"
#include "tests/simulation/stress_scenes.h"

namespace clothstream::bench {
namespace {

// Places where cloth passes through cloth, over all ticks.
struct Crossings {
  std::size_t ticks = 0;  // with at least one
  std::size_t most = 0;

  void add(std::size_t crossings) {
    ticks += crossings > 0;
    most = std::max(most, crossings);
  }
};

nlohmann::ordered_json rowOf(const tests::StressScene& stress, const char* who, const Samples& wall,
                             const Crossings& crossings) {
  const double nodeSteps = static_cast<double>(stress.scene.nodeCount()) * stress.scene.substeps;
  return {{"suite", "nothing_passes_peers"},
          {"scene", stress.scene.name},
          {"nodes", stress.scene.nodeCount()},
          {"ticks", wall.count()},
          {"who", who},
          {"nsMedian", wall.median() / nodeSteps * 1e9},
          {"tickMsMin", wall.min() * 1e3},
          {"tickMsMedian", wall.median() * 1e3},
          {"tickMsP99", wall.p99() * 1e3},
          {"crossedTicks", crossings.ticks},
          {"mostCrossings", crossings.most}};
}

}  // namespace

Rows compareNothingPasses(const vulkan::DeviceOptions& options, int ticks) {
  Rows rows;
  const std::vector<tests::StressScene> withBalls = tests::stressScenes(false),
                                        with = tests::stressScenes(true);
  for (std::size_t i = 0; i < with.size(); ++i) {
    const tests::StressScene& stress = with[i];
    vulkan::Device device(simulation::suitedTo(stress.scene.nodeCount(), options));
    Simulated balls(device, withBalls[i].scene, {}), ours(device, stress.scene, {});
    balls.restart(stress.start);
    ours.restart(stress.start);
    BulletStress bullet(stress);
    Samples bulletWall;
    Crossings crossings[3];
    for (int tick = 0; tick < std::min(stress.ticks, ticks); ++tick) {
      const simulation::TickInputs inputs{stress.scene.environment, stress.colliders(tick)};
      balls.tick(inputs);
      ours.tick(inputs);
      bulletWall.add(secondsOf([&] { bullet.tick(inputs.colliders); }));
      crossings[0].add(tests::intersections(stress.scene, balls.state().positions));
      crossings[1].add(tests::intersections(stress.scene, ours.state().positions));
      crossings[2].add(tests::intersections(stress.scene, bullet.positions()));
    }
    rows.push_back(rowOf(stress, "balls", balls.wall(), crossings[0]));
    rows.push_back(rowOf(stress, "nothingPasses", ours.wall(), crossings[1]));
    rows.push_back(rowOf(stress, "Bullet 3.24 deformable", bulletWall, crossings[2]));
  }
  return rows;
}

}  // namespace clothstream::bench
