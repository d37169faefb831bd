// SPDX-License-Identifier: MIT
// Stress scenes in Bullet's deformable world.
#include "tests/bench/peers/bullet_stress.h"

#include <array>
#include <stdexcept>
#include <variant>

#include <BulletCollision/BroadphaseCollision/btDbvtBroadphase.h>
#include <BulletSoftBody/btDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableGravityForce.h>
#include <BulletSoftBody/btDeformableMassSpringForce.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <btBulletDynamicsCommon.h>

#include "server/model/mesh.h"
#include "server/simulation/scene_tables.h"

namespace clothstream::bench {
namespace {

// Half of the size of a box that stands for a plane, m.
constexpr float kGround = 4;

btVector3 vectorOf(const model::Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

// The place between two poses.
btTransform transformAt(const simulation::MovingCollider& collider, float share) {
  const model::Quaternion turn = collider.start.orientation.slerp(share, collider.end.orientation);
  model::Vec3 position = collider.start.position + share * (collider.end.position - collider.start.position);
  if (std::holds_alternative<model::Plane>(collider.shape)) position.y() -= kGround;
  return btTransform(btQuaternion(turn.x(), turn.y(), turn.z(), turn.w()), vectorOf(position));
}

std::unique_ptr<btCollisionShape> shapeOf(const model::Shape& shape) {
  if (std::holds_alternative<model::Plane>(shape))
    return std::make_unique<btBoxShape>(btVector3(kGround, kGround, kGround));
  if (const auto* box = std::get_if<model::Box>(&shape))
    return std::make_unique<btBoxShape>(vectorOf(box->size / 2));
  if (const auto* capsule = std::get_if<model::Capsule>(&shape))
    return std::make_unique<btCapsuleShape>(capsule->radius, capsule->length);
  throw std::runtime_error("a stress scene has a shape that the comparison with Bullet does not know");
}

}  // namespace

struct BulletStress::World {
  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher{&configuration};
  btDbvtBroadphase broadphase;
  btDeformableBodySolver bodySolver;
  btDeformableMultiBodyConstraintSolver solver;
  btDeformableMultiBodyDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration, &bodySolver};
  std::vector<std::unique_ptr<btSoftBody>> cloths;
  std::vector<std::unique_ptr<btDeformableLagrangianForce>> forces;
  std::vector<std::unique_ptr<btCollisionShape>> shapes;
  std::vector<std::unique_ptr<btRigidBody>> bodies;
};

BulletStress::BulletStress(const tests::StressScene& stress)
    : stepSeconds_(static_cast<float>(stress.scene.substepSeconds())),
      steps_(static_cast<int>(stress.scene.substeps)),
      world_(std::make_unique<World>()) {
  World& world = *world_;
  world.solver.setDeformableSolver(&world.bodySolver);
  const btVector3 gravity(0, btScalar(-9.81), 0);
  world.dynamics.setGravity(gravity);
  btSoftBodyWorldInfo& info = world.dynamics.getWorldInfo();
  info.m_gravity = gravity;
  info.m_sparsesdf.setDefaultVoxelsz(btScalar(0.25));
  info.m_sparsesdf.Reset();
  world.forces.push_back(std::make_unique<btDeformableGravityForce>(gravity));
  const std::vector<float> inverseMasses = simulation::inverseMasses(stress.scene.cloths);
  std::size_t node = 0;
  for (const model::Cloth& cloth : stress.scene.cloths) {
    std::vector<btScalar> places;
    for (std::size_t i = 0; i < cloth.nodeCount(); ++i)
      for (Eigen::Index k = 0; k < 3; ++k) places.push_back(stress.start.positions[node + i][k]);
    std::vector<int> corners;
    for (const model::Triangle& triangle : model::clothTriangles(cloth))
      for (const std::uint32_t corner : triangle) corners.push_back(static_cast<int>(corner));
    world.cloths.emplace_back(btSoftBodyHelpers::CreateFromTriMesh(
        info, places.data(), corners.data(), static_cast<int>(corners.size() / 3), false));
    btSoftBody& body = *world.cloths.back();
    for (int i = 0; i < body.m_nodes.size(); ++i, ++node) {
      const float inverse = inverseMasses[node];
      body.setMass(i, inverse > 0 ? 1 / inverse : 0);
      body.m_nodes[i].m_v = vectorOf(stress.start.velocities[node]);
    }
    body.getCollisionShape()->setMargin(cloth.selfCollision->radius);
    body.setSpringStiffness(cloth.structural.stiffness);
    body.setDampingCoefficient(cloth.structural.damping);
    body.m_cfg.kKHR = 1;
    body.m_cfg.kCHR = 1;
    body.m_cfg.kDF = cloth.selfCollision->friction;
    body.m_cfg.collisions = btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::VF_DD;
    body.setCollisionFlags(0);
    body.setSelfCollision(true);
    world.dynamics.addSoftBody(&body);
    world.forces.push_back(std::make_unique<btDeformableMassSpringForce>(cloth.structural.stiffness,
                                                                         cloth.structural.damping, true));
    world.dynamics.addForce(&body, world.forces.back().get());
    world.dynamics.addForce(&body, world.forces.front().get());
  }
  for (const simulation::MovingCollider& collider : stress.colliders(0)) {
    world.shapes.push_back(shapeOf(collider.shape));
    world.bodies.push_back(std::make_unique<btRigidBody>(0, nullptr, world.shapes.back().get()));
    btRigidBody& body = *world.bodies.back();
    body.setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    body.setActivationState(DISABLE_DEACTIVATION);
    body.setFriction(collider.friction);
    body.setWorldTransform(transformAt(collider, 0));
    body.setInterpolationWorldTransform(transformAt(collider, 0));
    world.dynamics.addRigidBody(&body);
  }
}

BulletStress::~BulletStress() {
  for (const auto& cloth : world_->cloths) world_->dynamics.removeSoftBody(cloth.get());
  for (const auto& body : world_->bodies) world_->dynamics.removeRigidBody(body.get());
}

void BulletStress::tick(std::span<const simulation::MovingCollider> colliders) {
  for (int step = 0; step < steps_; ++step) {
    for (std::size_t i = 0; i < colliders.size(); ++i)
      world_->bodies[i]->setWorldTransform(
          transformAt(colliders[i], static_cast<float>(step + 1) / static_cast<float>(steps_)));
    world_->dynamics.stepSimulation(stepSeconds_, 1, stepSeconds_);
  }
}

std::vector<model::Vec3> BulletStress::positions() const {
  std::vector<model::Vec3> positions;
  for (const auto& cloth : world_->cloths)
    for (int i = 0; i < cloth->m_nodes.size(); ++i) {
      const btVector3& x = cloth->m_nodes[i].m_x;
      positions.emplace_back(static_cast<float>(x.x()), static_cast<float>(x.y()), static_cast<float>(x.z()));
    }
  return positions;
}

}  // namespace clothstream::bench
