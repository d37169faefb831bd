// SPDX-License-Identifier: MIT
// One cloth in double precision, serial, spring by spring: the oracle of the kernels and the CPU baseline.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "server/model/hinges.h"
#include "server/model/mesh.h"
#include "server/model/scene.h"
#include "server/model/spring_colours.h"
#include "server/model/springs.h"
#include "server/reference/contact.h"

namespace clothstream::reference {

// Of the structural springs: |d| / L - 1.
struct Strain {
  double max = 0;   // largest stretch
  double p99 = 0;   // the smallest that 99 % of them do not exceed
  double mean = 0;  // mean of the absolute values
};

// A grid's nodes are row-major. Not thread-safe; after construction no member allocates but normals(), and
// solvers that solve a system.
class ReferenceCloth {
 public:
  // At rest in its start pose. Springs are those of model::springLinks().
  explicit ReferenceCloth(const model::Cloth& cloth);

  // Springs, bending, damping, drag, lift, friction, thickness, mass, solver from now on; same shape, same
  // pins.
  void setParameters(const model::Cloth& cloth);

  std::span<Vec3> positions() { return positions_; }
  std::span<const Vec3> positions() const { return positions_; }
  std::span<Vec3> velocities() { return velocities_; }
  std::span<const Vec3> velocities() const { return velocities_; }
  // 1/kg; 0 for pinned nodes, which go on at the velocity that they are given.
  std::span<const double> inverseMasses() const { return inverseMasses_; }
  std::uint32_t nodeCount() const { return cloth_.nodeCount(); }
  // kg; of pinned nodes too.
  std::span<const double> masses() const { return masses_; }

  // Both add to one force a node, N. [Va21] Eq. 1; air with drag and lift a triangle.
  void accumulateSpringForces(std::span<Vec3> forces) const;
  void accumulateAirForces(const model::Environment& environment, std::span<Vec3> forces) const;

  // J of dihedral bending, and what it pulls at nodes with, N: scene/hinges.h.
  double bendingEnergy() const;
  void accumulateBendingForces(std::span<Vec3> forces) const;

  // Forces, one step of h seconds, and the cloth's constraints; colliders apart.
  void integrate(const model::Environment& environment, model::Integrator integrator, double h);

  // Nodes on their way from `from`, one place a node, to where they are go out of the shape; their velocity
  // relative to its surface loses what goes into it, and the rest meets Coulomb friction ([Va21] 3.4, Alg.
  // 4). `only`: one byte a node, which of them; empty: all.
  void collide(const model::Shape& shape, const ColliderStep& step, double friction,
               std::span<const Vec3> from, std::span<const std::uint8_t> only = {});

  // Unit normals; (0,0,1) where they vanish. A grid's from up to eight triangles round a node ([Va21] 3.5,
  // Alg. 5), a mesh's from the area vectors of a node's triangles.
  std::vector<Vec3> normals() const;

  // J, of the nodes that can move; gravity's is 0 at the origin.
  double kineticEnergy() const;
  double elasticEnergy() const;
  double gravityEnergy(const Vec3& gravity) const;
  Strain strain() const;
  // How deep the deepest node that can move lies below the shape's surface, m; 0 where none does.
  double penetration(const model::Shape& shape, const Pose& pose) const;

 private:
  void setMass(float mass);
  // m/s^2; 0 of pinned nodes. Until the next call.
  const std::vector<Vec3>& accelerations(const model::Environment& environment);
  void integrateRungeKutta(const model::Environment& environment, double h);
  void bend(double h);
  void enforceConstraints(double h);
  void takeImplicitVelocities(double h);
  void correctSprings(double h);
  std::vector<Vec3> gridNormals() const;
  std::vector<Vec3> meshNormals() const;

  model::Cloth cloth_;
  std::vector<model::SpringLink> links_;
  std::vector<model::Triangle> triangles_;
  std::vector<model::Hinge> hinges_;  // once they are needed
  std::vector<Vec3> positions_, velocities_, forces_;
  std::vector<Vec3> start_, startVelocities_;  // of the substep, where a system is solved
  model::SpringColours colours_;               // of xpbd, once they are needed
  std::vector<double> masses_, inverseMasses_;
};

}  // namespace clothstream::reference
