// SPDX-License-Identifier: MIT
// A square sheet in Bullet, hung by two corners.
#include "tests/bench/peers/bullet_cloth.h"

#include <cmath>

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletDynamics/ConstraintSolver/btSequentialImpulseConstraintSolver.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>

namespace clothstream::bench {

struct BulletCloth::World {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
  btSoftBody* sheet = nullptr;  // owned by the world
};

BulletCloth::BulletCloth(std::uint32_t size, int positionIterations)
    : size_(size), world_(std::make_unique<World>()) {
  const btVector3 gravity(0, btScalar(-9.81), 0);
  world_->dynamics.setGravity(gravity);
  world_->dynamics.getWorldInfo().m_gravity = gravity;
  constexpr int kFirstTwoCorners = 1 + 2;
  const int resolution = static_cast<int>(size);
  btSoftBody* sheet =
      btSoftBodyHelpers::CreatePatch(world_->dynamics.getWorldInfo(), {0, 0, 0}, {1, 0, 0}, {0, 0, 1},
                                     {1, 0, 1}, resolution, resolution, kFirstTwoCorners, true);
  sheet->generateBendingConstraints(2);
  sheet->m_cfg.piterations = positionIterations;
  sheet->m_cfg.collisions = 0;
  sheet->setTotalMass(1);
  world_->sheet = sheet;
  world_->dynamics.addSoftBody(sheet);
}

BulletCloth::~BulletCloth() {
  world_->dynamics.removeSoftBody(world_->sheet);
  delete world_->sheet;
}

void BulletCloth::step(float seconds) {
  world_->dynamics.stepSimulation(seconds, 0);
}

double BulletCloth::meanStrain() const {
  const double rest = 1.0 / (size_ - 1);
  const auto strain = [&](std::uint32_t a, std::uint32_t b) {
    const btVector3 d =
        world_->sheet->m_nodes[static_cast<int>(a)].m_x - world_->sheet->m_nodes[static_cast<int>(b)].m_x;
    return std::abs(static_cast<double>(d.length()) - rest) / rest;
  };
  double sum = 0;
  for (std::uint32_t row = 0; row < size_; ++row)
    for (std::uint32_t column = 0; column + 1 < size_; ++column)
      sum += strain(row * size_ + column, row * size_ + column + 1) +
             strain(column * size_ + row, (column + 1) * size_ + row);
  return sum / (2.0 * size_ * (size_ - 1));
}

}  // namespace clothstream::bench
