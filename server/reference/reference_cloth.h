// SPDX-License-Identifier: MIT
// One cloth in double precision, serial, spring by spring: the reference for the kernels and the CPU
// baseline.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/model/hinges.h"
#include "server/model/mesh.h"
#include "server/model/scene.h"
#include "server/model/spring_colours.h"
#include "server/model/springs.h"
#include "server/reference/contact.h"
#include "server/reference/surface.h"

namespace clothstream::reference {

// Stretch |d| / L - 1 of the structural springs.
struct Strain {
  double max = 0;   // largest stretch
  double p99 = 0;   // the smallest value that 99 % of them do not exceed
  double mean = 0;  // mean of the absolute values
};

// Nodes of a grid are row-major. Not thread-safe. After construction only normals() and solvers of linear
// systems allocate memory.
class ReferenceCloth {
 public:
  // Starts at rest in its start pose. The springs are those of model::springLinks().
  explicit ReferenceCloth(const model::Cloth& cloth);

  // Sets springs, bending, damping, drag, lift, friction, thickness, pressure, mass and solver. Shape and
  // pins must stay the same.
  void setParameters(const model::Cloth& cloth);
  // Sets the local winds, which add to the wind of the environment; at first there are none.
  void setWinds(std::span<const model::LocalWind> winds) { winds_.assign(winds.begin(), winds.end()); }

  std::span<Vec3> positions() { return positions_; }
  std::span<const Vec3> positions() const { return positions_; }
  std::span<Vec3> velocities() { return velocities_; }
  std::span<const Vec3> velocities() const { return velocities_; }
  // 1/kg; 0 for pinned nodes, which keep the velocity that they are given.
  std::span<const double> inverseMasses() const { return inverseMasses_; }
  std::uint32_t nodeCount() const { return cloth_.nodeCount(); }
  // kg, also of pinned nodes.
  std::span<const double> masses() const { return masses_; }

  // Both functions add one force per node, N: [Va21] Eq. 1, and air with drag and lift per triangle.
  void accumulateSpringForces(std::span<Vec3> forces) const;
  void accumulateAirForces(const model::Environment& environment, std::span<Vec3> forces) const;

  // Energy of dihedral bending, J, and its forces on the nodes, N: model/hinges.h.
  double bendingEnergy() const;
  void accumulateBendingForces(std::span<Vec3> forces) const;

  // Pressure of the gas in the last step, above the pressure outside, Pa; 0 without gas.
  double gasPressure() const { return gasPressure_; }

  // Computes forces, takes one step of h seconds, and enforces the cloth's constraints; without colliders.
  void integrate(const model::Environment& environment, model::Integrator integrator, double h);

  // Moves nodes out of the shape on their way from `from` (one place per node) to their positions. Their
  // velocity relative to the surface loses the part into the surface, and Coulomb friction acts on the rest
  // ([Va21] 3.4, Alg. 4): that of each contact after the next one, that of the last one in finishContacts().
  // `only` selects nodes, one byte per node; empty: all.
  void collide(const model::Shape& shape, const ColliderStep& step, double friction,
               std::span<const Vec3> from, std::span<const std::uint8_t> only = {});
  void finishContacts(std::span<const Vec3> from);
  // The same for surfaces of the real room, with the friction of all contacts: a node has at most
  // model::kSurfaceRounds contacts, and stays where it was if it then crosses a surface. `seconds`: of the
  // substep.
  void collide(std::span<const PlacedSurface> surfaces, double seconds, std::span<const Vec3> from);

  // Unit normals; (0,0,1) if they vanish. A grid uses up to eight triangles around a node ([Va21] 3.5, Alg.
  // 5), a mesh the area vectors of a node's triangles.
  std::vector<Vec3> normals() const;

  // Energies of free nodes, J; the gravity energy is 0 at the origin.
  double kineticEnergy() const;
  double elasticEnergy() const;
  double gravityEnergy(const Vec3& gravity) const;
  Strain strain() const;
  // Depth of the deepest free node below the shape's surface, m; 0 if no node is below.
  double penetration(const model::Shape& shape, const Pose& pose) const;

 private:
  // A contact whose friction has not acted yet.
  struct Press {
    Vec3 normal, before;  // its normal, and that of the contact before it; 0 if none, or opposed
    Vec3 carried;         // velocity of the surface
    double most;          // speed that friction takes
    double seconds;       // of the substep
  };
  // Moves a node out of a contact, after the friction of the contact before it. `velocity` and `place`: those
  // of the surface there and of what it belongs to.
  void leave(std::size_t node, const Contact& contact, const Vec3& velocity, const Vec3& place,
             double friction, double seconds, const Vec3& from);
  // Moves nothing into the surfaces of the contacts before and after this one (`next`), unless opposed.
  void rub(std::size_t node, const Press& press, const Vec3& next, const Vec3& from);
  void setMass(float mass);
  // m/s^2; 0 for pinned nodes. Valid until the next call.
  const std::vector<Vec3>& accelerations(const model::Environment& environment);
  void integrateRungeKutta(const model::Environment& environment, double h);
  void bend(double h);
  // Moves the nodes, which are at the end of their free motion from `start_`, by the impulses of the gas:
  // model/gas.h.
  void press(double h);
  // True if a spring of this length, m, is a constraint instead of a force: model::AcadMode::paper.
  bool isReplaced(const model::SpringLink& link, double length) const;
  void enforceConstraints(double h);
  void limitStretch(double h);
  void takeImplicitVelocities(double h);
  void correctSprings(double h);
  std::vector<Vec3> gridNormals() const;
  std::vector<Vec3> meshNormals() const;

  model::Cloth cloth_;
  std::vector<model::LocalWind> winds_;
  std::vector<model::SpringLink> links_;
  std::vector<model::Triangle> triangles_;
  std::vector<model::Hinge> hinges_;  // created at first use
  std::vector<Vec3> positions_, velocities_, forces_;
  std::vector<std::optional<Press>> presses_;  // by node, of the contacts since finishContacts()
  std::vector<Vec3> start_, startVelocities_;  // at the substep's start, for solvers of linear systems
  model::SpringColours colours_;               // of xpbd, created at first use
  std::vector<double> masses_, inverseMasses_;
  double gasPressure_ = 0;  // Pa
  // Volume that the last step has foreseen, as a fraction of the volume at rest, and the square of its
  // length, s^2; 0: there was no gas.
  double foreseenVolume_ = 0, squaredStep_ = 0;
  double stiffnessShare_ = 1;  // model::stiffnessShare() of the last substep
};

}  // namespace clothstream::reference
