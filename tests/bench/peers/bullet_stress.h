// SPDX-License-Identifier: MIT
// Stress scenes in Bullet's deformable world, with its self-collision of nodes and triangles.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "tests/simulation/stress_scenes.h"

namespace clothstream::bench {

class BulletStress {
 public:
  // Springs have the structural stiffness and damping of the cloths. Margins are the radii of the balls.
  explicit BulletStress(const tests::StressScene& stress);
  ~BulletStress();

  // Advances by a tick, in as many steps as the scene has substeps.
  void tick(std::span<const simulation::MovingCollider> colliders);
  std::vector<model::Vec3> positions() const;

 private:
  struct World;
  float stepSeconds_;
  int steps_;
  std::unique_ptr<World> world_;
};

}  // namespace clothstream::bench
