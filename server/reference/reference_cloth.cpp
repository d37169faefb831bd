// SPDX-License-Identifier: MIT
// The mass-spring cloth of [Va21] in double precision.
#include "server/reference/reference_cloth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

#include "server/model/gas.h"
#include "server/model/stability.h"
#include "server/model/strain_limit.h"
#include "server/reference/constraint_system.h"
#include "server/reference/implicit_system.h"
#include "server/reference/limit_system.h"

namespace clothstream::reference {
namespace {

constexpr double kTinyLengthSquared = 1e-12;  // m^2, of a spring
constexpr double kTinyAirSquared = 1e-20;     // of |u||N|, m^6/s^2
constexpr double kTinyNormalSquared = 1e-30;  // m^4
constexpr double kDepthRounding = 2.4e-7;     // of the kernels' contacts, relative to coordinates
constexpr double kOpposed = -0.5;             // product of the normals of two contacts that pinch

// `u` is the velocity of the air relative to the triangle, `N` its area vector.
Vec3 airForce(const Vec3& u, const Vec3& N, double density, double drag, double lift) {
  const double flow = N.dot(u);
  const double square = u.squaredNorm() * N.squaredNorm();
  if (square < kTinyAirSquared) return Vec3::Zero();
  return 0.5 * density *
         (drag * std::abs(flow) * u + lift * flow / std::sqrt(square) * (N * u.squaredNorm() - flow * u));
}

Vec3 unitNormal(const Vec3& sum) {
  const double square = sum.squaredNorm();
  return square < kTinyNormalSquared ? Vec3::UnitZ() : Vec3(sum / std::sqrt(square));
}

}  // namespace

ReferenceCloth::ReferenceCloth(const model::Cloth& cloth)
    : cloth_(cloth),
      links_(model::springLinks(cloth)),
      triangles_(model::clothTriangles(cloth)),
      velocities_(cloth.nodeCount(), Vec3::Zero()),
      forces_(cloth.nodeCount(), Vec3::Zero()),
      masses_(model::nodeMasses(cloth)) {
  for (const model::Vec3& position : model::restPositions(cloth))
    positions_.push_back(position.cast<double>());
  for (const double mass : masses_) inverseMasses_.push_back(1 / mass);
  const std::vector<std::uint8_t> pinned = model::pinnedNodes(cloth);
  for (std::size_t i = 0; i < pinned.size(); ++i)
    if (pinned[i]) inverseMasses_[i] = 0;
  if (cloth_.dihedralBending > 0) hinges_ = model::hinges(cloth_);
}

void ReferenceCloth::setMass(float mass) {
  cloth_.mass = mass;
  masses_ = model::nodeMasses(cloth_);
  for (std::size_t i = 0; i < masses_.size(); ++i)
    if (inverseMasses_[i] > 0) inverseMasses_[i] = 1 / masses_[i];
}

void ReferenceCloth::setParameters(const model::Cloth& cloth) {
  assert(cloth.nodeCount() == cloth_.nodeCount() && cloth.mesh == cloth_.mesh);
  cloth_.structural = cloth.structural;
  cloth_.shear = cloth.shear;
  cloth_.bend = cloth.bend;
  cloth_.dihedralBending = cloth.dihedralBending;
  if (cloth_.dihedralBending > 0 && hinges_.empty()) hinges_ = model::hinges(cloth_);
  cloth_.damping = cloth.damping;
  cloth_.drag = cloth.drag;
  cloth_.lift = cloth.lift;
  cloth_.friction = cloth.friction;
  cloth_.thickness = cloth.thickness;
  cloth_.pressure = cloth.pressure;
  cloth_.solver = cloth.solver;
  setMass(cloth.mass);
}

bool ReferenceCloth::isReplaced(const model::SpringLink& link, double length) const {
  return model::isAcad(cloth_.solver, model::AcadMode::paper) &&
         model::isConstraint(cloth_.solver, link.kind) &&
         length > (1 + double{cloth_.solver.activation}) * link.restLength;
}

void ReferenceCloth::accumulateSpringForces(std::span<Vec3> forces) const {
  for (const model::SpringLink& link : links_) {
    const model::Spring spring = model::forceOf(cloth_, link.kind);
    const Vec3 d = positions_[link.b] - positions_[link.a];
    if (isReplaced(link, d.norm())) continue;
    const double square = std::max(d.squaredNorm(), kTinyLengthSquared);
    const double elastic =
        stiffnessShare_ * spring.stiffness * (1 - double{link.restLength} / std::sqrt(square));
    const double viscous = spring.damping * (velocities_[link.b] - velocities_[link.a]).dot(d) / square;
    const Vec3 force = (elastic + viscous) * d;
    forces[link.a] += force;
    forces[link.b] -= force;
  }
}

namespace {

std::array<Vec3, 4> cornersOf(const model::Hinge& hinge, std::span<const Vec3> positions) {
  std::array<Vec3, 4> corners;
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = positions[hinge.nodes[i]];
  return corners;
}

}  // namespace

void ReferenceCloth::accumulateBendingForces(std::span<Vec3> forces) const {
  for (const model::Hinge& hinge : hinges_) {
    const model::HingeShape shape = model::hingeShape(cornersOf(hinge, positions_), hinge.leastSquare);
    const double bent = model::bentFromRest(shape, double{hinge.restAngle});
    const double strength = -double{cloth_.dihedralBending} * hinge.weight * bent;
    for (std::size_t i = 0; i < hinge.nodes.size(); ++i)
      forces[hinge.nodes[i]] += strength * shape.gradients[i];
  }
}

// 4 (1 - cos(delta / 2)) for each hinge.
double ReferenceCloth::bendingEnergy() const {
  double sum = 0;
  for (const model::Hinge& hinge : hinges_) {
    const model::HingeShape shape = model::hingeShape(cornersOf(hinge, positions_), hinge.leastSquare);
    const double sine = std::clamp(model::bentFromRest(shape, double{hinge.restAngle}) / 2, -1.0, 1.0);
    sum += hinge.weight * 4 * (1 - std::sqrt(1 - sine * sine));
  }
  return cloth_.dihedralBending * sum;
}

void ReferenceCloth::bend(double h) {
  if (cloth_.dihedralBending == 0) return;
  std::ranges::fill(forces_, Vec3::Zero());
  accumulateBendingForces(forces_);
  for (std::size_t i = 0; i < forces_.size(); ++i) velocities_[i] += h * inverseMasses_[i] * forces_[i];
}

void ReferenceCloth::press(double h) {
  if (!model::hasGas(cloth_)) {
    gasPressure_ = foreseenVolume_ = squaredStep_ = 0;
    return;
  }
  const double rest = cloth_.mesh->volume, squared = h * h;
  const std::vector<Vec3> gradients = model::volumeGradients(triangles_, start_);
  const double volume = model::enclosedVolume(triangles_, start_) / rest;
  double growth = 0, response = 0;
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    growth += gradients[i].dot(positions_[i] - start_[i]) / rest;
    response += gradients[i].squaredNorm() * inverseMasses_[i];
  }
  response *= squared * model::kOutsidePressure / rest;
  const double later = squaredStep_ == 0 ? 0 : squared / squaredStep_ * (volume - foreseenVolume_);
  const double free = volume + growth + later;
  const double lawful = model::gasPressure(cloth_.pressure / model::kOutsidePressure, free, response);
  const double pressure = model::boundedPressure(lawful, volume, free, response);
  foreseenVolume_ = volume + growth + response * pressure;
  squaredStep_ = squared;
  gasPressure_ = pressure * model::kOutsidePressure;
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    const Vec3 change = h * gasPressure_ * inverseMasses_[i] * gradients[i];
    velocities_[i] += change;
    positions_[i] += h * change;
  }
}

void ReferenceCloth::accumulateAirForces(const model::Environment& environment,
                                         std::span<Vec3> forces) const {
  const double density = environment.airDensity, drag = cloth_.drag, lift = cloth_.lift;
  if (density * drag == 0 && density * lift == 0) return;
  const Vec3 wind = environment.wind.cast<double>();
  for (const model::Triangle& triangle : triangles_) {
    const auto [p0, p1, p2] = triangle;
    const Vec3 velocity = (velocities_[p0] + velocities_[p1] + velocities_[p2]) / 3;
    const Vec3 N = (positions_[p1] - positions_[p0]).cross(positions_[p2] - positions_[p0]) / 2;
    Vec3 u = wind - velocity;
    if (!winds_.empty())
      u += model::velocityAt(winds_, (positions_[p0] + positions_[p1] + positions_[p2]) / 3);
    const Vec3 share = airForce(u, N, density, drag, lift) / 3;
    for (const std::uint32_t node : triangle) forces[node] += share;
  }
}

const std::vector<Vec3>& ReferenceCloth::accelerations(const model::Environment& environment) {
  std::ranges::fill(forces_, Vec3::Zero());
  accumulateSpringForces(forces_);
  accumulateAirForces(environment, forces_);
  const Vec3 gravity = environment.gravity.cast<double>();
  for (std::size_t i = 0; i < positions_.size(); ++i)
    forces_[i] =
        inverseMasses_[i] == 0
            ? Vec3(Vec3::Zero())
            : Vec3(forces_[i] * inverseMasses_[i] + gravity - double{cloth_.damping} * velocities_[i]);
  return forces_;
}

void ReferenceCloth::integrateRungeKutta(const model::Environment& environment, double h) {
  const std::vector<Vec3> start = positions_, startVelocities = velocities_;
  std::vector<Vec3> moves(start.size(), Vec3::Zero()), changes(start.size(), Vec3::Zero());
  constexpr double kNext[] = {0.5, 0.5, 1, 0}, kWeight[] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
  for (int stage = 0; stage < 4; ++stage) {
    const std::vector<Vec3>& rates = accelerations(environment);
    for (std::size_t i = 0; i < start.size(); ++i) {
      const Vec3 velocity = velocities_[i];
      moves[i] += kWeight[stage] * h * velocity;
      changes[i] += kWeight[stage] * h * rates[i];
      positions_[i] = start[i] + kNext[stage] * h * velocity;
      velocities_[i] = startVelocities[i] + kNext[stage] * h * rates[i];
    }
  }
  for (std::size_t i = 0; i < start.size(); ++i) {
    positions_[i] = start[i] + moves[i];
    velocities_[i] = startVelocities[i] + changes[i];
  }
}

void ReferenceCloth::integrate(const model::Environment& environment, model::Integrator integrator,
                               double h) {
  if (integrator == model::Integrator::rungeKutta4) return integrateRungeKutta(environment, h);
  bend(h);
  stiffnessShare_ = model::stiffnessShare(cloth_, h);
  const std::vector<Vec3>& rates = accelerations(environment);
  const model::SolverKind solver = cloth_.solver.kind;
  if (solver != model::SolverKind::massSpring || model::hasGas(cloth_)) start_ = positions_;
  if (solver == model::SolverKind::implicitEuler) startVelocities_ = velocities_;
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (integrator == model::Integrator::explicitEuler) {
      positions_[i] += h * velocities_[i];
      velocities_[i] += h * rates[i];
    } else {
      velocities_[i] += h * rates[i];
      positions_[i] += h * velocities_[i];
    }
  }
  press(h);
  if (model::isAcad(cloth_.solver, model::AcadMode::limit))
    limitStretch(h);
  else if (solver == model::SolverKind::constraint || solver == model::SolverKind::acad)
    enforceConstraints(h);
  if (solver == model::SolverKind::implicitEuler) takeImplicitVelocities(h);
  if (solver == model::SolverKind::xpbd) correctSprings(h);
}

void ReferenceCloth::takeImplicitVelocities(double h) {
  std::vector<ImplicitSpring> springs;
  for (const model::SpringLink& link : links_) {
    const model::Spring& spring = model::springOf(cloth_, link.kind);
    springs.push_back({link.a, link.b, spring.stiffness, spring.damping, link.restLength});
  }
  const std::vector<Vec3> changes =
      ImplicitSystem(springs, start_, startVelocities_, velocities_, inverseMasses_, h).solve();
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    velocities_[i] += changes[i];
    positions_[i] += h * changes[i];
  }
}

// [MMC16] Alg. 1, Eq. 18 and 26. C is the excess length; its gradient is a unit vector at b and the negative
// at a.
void ReferenceCloth::correctSprings(double h) {
  if (colours_.links.empty()) colours_ = model::springColours(cloth_);
  std::vector<double> multipliers(colours_.links.size(), 0);
  for (std::uint32_t iteration = 0; iteration < cloth_.solver.iterations; ++iteration)
    for (std::size_t i = 0; i < colours_.links.size(); ++i) {
      const model::SpringLink& link = colours_.links[i];
      const double weight = inverseMasses_[link.a] + inverseMasses_[link.b];
      const model::Spring& spring = model::springOf(cloth_, link.kind);
      const bool overridden = cloth_.solver.compliance && link.kind != model::SpringKind::bend;
      if (weight == 0 || (!overridden && spring.stiffness == 0)) continue;
      const double compliance = overridden ? double{*cloth_.solver.compliance} : 1 / double{spring.stiffness};
      const double scaled = compliance / (h * h), gamma = compliance * spring.damping / h;
      const Vec3 d = positions_[link.b] - positions_[link.a];
      const double length = std::sqrt(std::max(d.squaredNorm(), kTinyLengthSquared));
      const Vec3 direction = d / length;
      const Vec3 begun = start_[link.b] - start_[link.a];
      const double growth = direction.dot(d - begun);
      const double excess = length - double{link.restLength};
      const double step =
          -(excess + scaled * multipliers[i] + gamma * growth) / ((1 + gamma) * weight + scaled);
      multipliers[i] += step;
      const double gain = begun.dot(d) / (length * length);
      const Vec3 way = gain > 0.5 && gain < 1.5 ? Vec3((2 - gain) / length * begun) : direction;
      positions_[link.a] -= inverseMasses_[link.a] * step * way;
      positions_[link.b] += inverseMasses_[link.b] * step * way;
    }
  for (std::size_t i = 0; i < positions_.size(); ++i)
    if (inverseMasses_[i] > 0) velocities_[i] = (positions_[i] - start_[i]) / h;
}

void ReferenceCloth::enforceConstraints(double h) {
  const model::Solver& solver = cloth_.solver;
  const double correctionFraction = model::correctionFraction(solver);
  std::vector<Constraint> constraints;
  for (const model::SpringLink& link : links_) {
    if (!model::isConstraint(solver, link.kind)) continue;
    const double rest = link.restLength;
    const Vec3 d = start_[link.b] - start_[link.a];
    if (solver.kind == model::SolverKind::constraint) {
      constraints.push_back({link.a, link.b, correctionFraction * (d.norm() - rest)});
    } else if (isReplaced(link, d.norm())) {
      constraints.push_back(
          {link.a, link.b, correctionFraction * (d.squaredNorm() - rest * rest) / (2 * d.norm())});
    }
  }
  const ConstraintSystem system(constraints, start_, velocities_, inverseMasses_,
                                model::scaledCompliance(cloth_, h), h);
  const std::vector<Vec3> moves =
      system.moves(system.conjugateGradients(solver.iterations, double{solver.tolerance}).multipliers);
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    positions_[i] += moves[i];
    velocities_[i] += moves[i] / h;
  }
}

void ReferenceCloth::limitStretch(double h) {
  const std::vector<Vec3> free = positions_;
  const double compliance = model::scaledCompliance(cloth_, h);
  const std::uint32_t iterations = model::iterationsOf(cloth_.solver);
  for (std::uint32_t round = 0; round < model::kLimitRounds; ++round) {
    std::vector<LimitedSpring> springs;
    for (const model::SpringLink& link : links_)
      if (model::isConstraint(cloth_.solver, link.kind))
        springs.push_back({link.a, link.b, link.restLength * (1 + double{model::heldStrain(cloth_.solver)})});
    if (!limitRound(springs, free, inverseMasses_, compliance, iterations, double{cloth_.solver.tolerance},
                    positions_))
      break;
  }
  for (std::size_t i = 0; i < positions_.size(); ++i) velocities_[i] += (positions_[i] - free[i]) / h;
}

void ReferenceCloth::collide(const model::Shape& shape, const ColliderStep& step, double friction,
                             std::span<const Vec3> from, std::span<const std::uint8_t> only) {
  presses_.resize(positions_.size());
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (inverseMasses_[i] == 0 || (!only.empty() && only[i] == 0)) continue;
    const std::optional<Contact> contact = contactOf(shape, cloth_.thickness, step, from[i], positions_[i]);
    if (!contact) continue;
    const Vec3 end = positions_[i] + contact->depth * contact->normal;
    const Vec3 carried = step.velocity + contact->velocity + step.spin.cross(end - step.after.position);
    leave(i, *contact, carried, step.after.position, friction, step.seconds, from[i]);
  }
}

void ReferenceCloth::leave(std::size_t i, const Contact& contact, const Vec3& carried, const Vec3& place,
                           double friction, double seconds, const Vec3& from) {
  positions_[i] += contact.depth * contact.normal;
  const double approach = (velocities_[i] - carried).dot(contact.normal);
  velocities_[i] -= std::min(approach, 0.0) * contact.normal;
  const double extents = (positions_[i] - place).lpNorm<1>() + positions_[i].lpNorm<1>();
  const double wayOut = (contact.depth - kDepthRounding * extents) / seconds - std::max(approach, 0.0);
  std::optional<Press>& last = presses_[i];
  const bool opposed = last && last->normal.dot(contact.normal) < kOpposed;
  if (last) rub(i, *last, opposed ? Vec3(Vec3::Zero()) : contact.normal, from);
  last = Press{contact.normal, last && !opposed ? last->normal : Vec3(Vec3::Zero()), carried,
               cloth_.friction * friction * std::max({-approach, wayOut, 0.0}), seconds};
}

void ReferenceCloth::collide(std::span<const PlacedSurface> surfaces, double seconds,
                             std::span<const Vec3> from) {
  if (surfaces.empty()) return;
  presses_.resize(positions_.size());
  const double thickness = std::max(cloth_.thickness, model::kLeastSurfaceDistance);
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (inverseMasses_[i] == 0) continue;
    bool touched = false;
    for (std::uint32_t round = 0; round < model::kSurfaceRounds; ++round) {
      const std::optional<SurfaceContact> found =
          touchSurfaces(surfaces, thickness, seconds, from[i], positions_[i]);
      if (!found) break;
      touched = true;
      const PlacedSurface& surface = surfaces[found->surface];
      leave(i, {found->normal, found->depth}, Vec3::Zero(), surface.pose.position, surface.friction, seconds,
            from[i]);
    }
    if (!touched) continue;
    rub(i, *presses_[i], Vec3::Zero(), from[i]);
    presses_[i].reset();
    if (!crossesSurfaces(surfaces, from[i], positions_[i])) continue;
    positions_[i] = from[i];
    velocities_[i] = Vec3::Zero();
  }
  presses_.clear();
}

void ReferenceCloth::finishContacts(std::span<const Vec3> from) {
  for (std::size_t i = 0; i < presses_.size(); ++i)
    if (presses_[i]) rub(i, *presses_[i], Vec3::Zero(), from[i]);
  presses_.clear();
}

void ReferenceCloth::rub(std::size_t i, const Press& press, const Vec3& next, const Vec3& from) {
  const auto change = [&](const Vec3& motion, double most) {
    const Vec3 along = motion - motion.dot(press.normal) * press.normal;
    const double length = along.norm();
    Vec3 held = length > 0 ? Vec3(-std::min(1.0, most / length) * along) : Vec3(Vec3::Zero());
    for (const Vec3& other : {press.before, next}) held -= std::min(held.dot(other), 0.0) * other;
    return held;
  };
  velocities_[i] += change(velocities_[i] - press.carried, press.most);
  positions_[i] += change(positions_[i] - from - press.seconds * press.carried, press.seconds * press.most);
}

std::vector<Vec3> ReferenceCloth::normals() const {
  return cloth_.mesh ? meshNormals() : gridNormals();
}

std::vector<Vec3> ReferenceCloth::meshNormals() const {
  std::vector<Vec3> normals(positions_.size(), Vec3::Zero());
  for (const model::Triangle& triangle : triangles_) {
    const auto [p0, p1, p2] = triangle;
    const Vec3 N = (positions_[p1] - positions_[p0]).cross(positions_[p2] - positions_[p0]);
    for (const std::uint32_t node : triangle) normals[node] += N;
  }
  for (Vec3& normal : normals) normal = unitNormal(normal);
  return normals;
}

std::vector<Vec3> ReferenceCloth::gridNormals() const {
  const int rows = static_cast<int>(cloth_.grid.rows), columns = static_cast<int>(cloth_.grid.columns);
  const auto at = [&](int row, int column) -> const Vec3& {
    return positions_[static_cast<std::size_t>(row) * cloth_.grid.columns + static_cast<std::size_t>(column)];
  };
  struct Direction {
    int row, column;
  };
  // Counter-clockwise seen from +Z: right, up, left, down.
  constexpr Direction kDirections[] = {{0, 1}, {-1, 0}, {0, -1}, {1, 0}};
  std::vector<Vec3> normals;
  normals.reserve(positions_.size());
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column) {
      Vec3 sum = Vec3::Zero();
      for (int quadrant = 0; quadrant < 4; ++quadrant) {
        const Direction a = kDirections[quadrant], b = kDirections[(quadrant + 1) % 4];
        const int cRow = row + a.row + b.row, cColumn = column + a.column + b.column;
        if (cRow < 0 || cRow >= rows || cColumn < 0 || cColumn >= columns) continue;
        const Vec3 toDiagonal = at(cRow, cColumn) - at(row, column);
        const Vec3 across = at(row + b.row, column + b.column) - at(row + a.row, column + a.column);
        sum += toDiagonal.cross(across);
      }
      normals.push_back(unitNormal(sum));
    }
  return normals;
}

double ReferenceCloth::kineticEnergy() const {
  double sum = 0;
  for (std::size_t i = 0; i < velocities_.size(); ++i)
    if (inverseMasses_[i] > 0) sum += masses_[i] * velocities_[i].squaredNorm();
  return 0.5 * sum;
}

double ReferenceCloth::elasticEnergy() const {
  double sum = 0;
  for (const model::SpringLink& link : links_) {
    const double extension = (positions_[link.b] - positions_[link.a]).norm() - double{link.restLength};
    sum += 0.5 * model::springOf(cloth_, link.kind).stiffness * extension * extension;
  }
  return sum;
}

double ReferenceCloth::gravityEnergy(const Vec3& gravity) const {
  double sum = 0;
  for (std::size_t i = 0; i < positions_.size(); ++i)
    if (inverseMasses_[i] > 0) sum -= masses_[i] * gravity.dot(positions_[i]);
  return sum;
}

double ReferenceCloth::penetration(const model::Shape& shape, const Pose& pose) const {
  double deepest = 0;
  for (std::size_t i = 0; i < positions_.size(); ++i)
    if (inverseMasses_[i] > 0) deepest = std::max(deepest, -heightOver(shape, pose, positions_[i]));
  return deepest;
}

Strain ReferenceCloth::strain() const {
  Strain strain{.max = -1};
  std::vector<double> stretches;
  for (const model::SpringLink& link : links_) {
    if (link.kind != model::SpringKind::structural) continue;
    const double stretch = (positions_[link.b] - positions_[link.a]).norm() / double{link.restLength} - 1;
    strain.max = std::max(strain.max, stretch);
    strain.mean += std::abs(stretch);
    stretches.push_back(stretch);
  }
  strain.mean /= static_cast<double>(stretches.size());
  std::ranges::sort(stretches);
  strain.p99 = stretches[(99 * stretches.size() + 99) / 100 - 1];
  return strain;
}

}  // namespace clothstream::reference
