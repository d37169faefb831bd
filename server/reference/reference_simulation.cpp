// SPDX-License-Identifier: MIT
// Ticks of the reference.
#include "server/reference/reference_simulation.h"

#include <algorithm>
#include <memory>

#include "server/model/cloth_skin.h"
#include "server/model/jump.h"
#include "server/model/wind.h"
#include "server/reference/solid.h"

namespace clothstream::reference {

TickInputs inputsAt(const model::Scene& scene, std::uint64_t tick) {
  TickInputs inputs{model::environmentAt(scene, tick), {}};
  inputs.winds.assign(scene.winds.begin(), scene.winds.end());
  const double start = static_cast<double>(tick) * scene.tickSeconds();
  const double end = static_cast<double>(tick + 1) * scene.tickSeconds();
  for (const model::Collider& collider : scene.colliders) {
    const model::Pose before = model::poseAt(collider, start), after = model::poseAt(collider, end);
    MovingCollider& to = inputs.colliders.emplace_back(
        MovingCollider{collider.shape, toPose(before), toPose(after), collider.friction});
    if (const auto* solid = std::get_if<model::Solid>(&collider.shape); solid != nullptr && (*solid)->skin) {
      const auto jointsAt = [&](double seconds, std::vector<model::Pose>& poses) {
        std::vector<model::Pose> local;
        model::jointsAt(*(*solid)->skin, seconds, local);
        model::compose(*(*solid)->skin, local, poses);
      };
      jointsAt(start, to.jointsStart);
      jointsAt(end, to.jointsEnd);
    }
    const bool moves = model::hasJumped(before, after, scene.tickSeconds()),
               bends = model::hasJumped(to.jointsStart, to.jointsEnd, scene.tickSeconds());
    to.jumped = moves || bends;
    to.before = to.start;
    to.jointsBefore = to.jointsStart;
    if (moves) to.start = to.end;
    if (bends) to.jointsStart = to.jointsEnd;
  }
  std::vector<model::Pose> before, after;
  for (const model::Cloth& cloth : scene.cloths)
    for (const model::Attachment& attachment : cloth.attachments) {
      before.push_back(model::frameAt(scene, attachment, start));
      after.push_back(model::frameAt(scene, attachment, end));
      inputs.attachments.push_back(toPose(after.back()));
    }
  for (const model::Carry& carry : model::carriesOf(scene, before, after))
    inputs.carries.push_back({carry.cloth, toPose(carry.from), toPose(carry.to)});
  return inputs;
}

ReferenceSimulation::ReferenceSimulation(const model::Scene& scene)
    : scene_(scene),
      cloths_(scene.cloths.begin(), scene.cloths.end()),
      attachments_(scene),
      skins_(scene),
      selfCollision_(scene),
      motionBound_(scene),
      coarse_(scene.cloths.size()),
      before_(scene.cloths.size()) {
  for (std::size_t i = 0; i < scene.cloths.size(); ++i) {
    const std::vector<model::Vec3> start = model::startPositions(scene, scene.cloths[i]);
    std::ranges::transform(start, cloths_[i].positions().begin(),
                           [](const model::Vec3& position) -> Vec3 { return position.cast<double>(); });
    const std::vector<model::Vec3> velocities = model::startVelocities(scene, scene.cloths[i]);
    std::ranges::transform(velocities, cloths_[i].velocities().begin(),
                           [](const model::Vec3& velocity) -> Vec3 { return velocity.cast<double>(); });
  }
  for (std::size_t i = 0; i < scene.cloths.size(); ++i)
    if (scene.cloths[i].coarse)
      for (const model::CoarseLevel& level : coarseLevels(scene.cloths[i]))
        coarse_[i].emplace_back(scene.cloths[i], level);
}

void ReferenceSimulation::tick(const TickInputs& inputs) {
  for (std::uint32_t index = 0; index < scene_.substeps; ++index) substep(inputs, index);
  ++ticks_;
}

void ReferenceSimulation::tick() {
  tick(inputsAt(scene_, ticks_));
}

void ReferenceSimulation::substep(const TickInputs& inputs, std::uint32_t index) {
  if (index == 0)
    for (const Carry& carry : inputs.carries) carryAlong(cloths_[carry.cloth], carry);
  if (index == 0) skins_.begin(cloths_, inputs.colliders, scene_.tickSeconds());
  if (index == 0) attachments_.begin(cloths_, inputs.attachments, inputs.grabs, scene_.tickSeconds());
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    ReferenceCloth& cloth = cloths_[i];
    for (const CoarseCorrection& level : coarse_[i]) correct(level, i, inputs, index);
    before_[i].assign(cloth.positions().begin(), cloth.positions().end());
    cloth.setWinds(inputs.winds);
    cloth.integrate(inputs.environment, scene_.integrator, scene_.substepSeconds());
    collide(inputs, index, i, false);
  }
  attachments_.apply(cloths_, inputs.grabs, index, scene_.substeps, scene_.tickSeconds());
  if (selfCollision_.exists())
    for (int i = 0; i < model::kContactIterations; ++i) collideWithCloth(inputs, index);
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    collide(inputs, index, i, true);
    cloths_[i].collide(inputs.surfaces, scene_.substepSeconds(), before_[i]);
  }
  skins_.apply(cloths_, index, scene_.substeps, scene_.tickSeconds());
  if (motionBound_.exists()) boundMotion();
}

void ReferenceSimulation::collide(const TickInputs& inputs, std::uint32_t index, std::size_t cloth,
                                  bool solids, std::span<const std::uint8_t> only) {
  for (const MovingCollider& collider : inputs.colliders) {
    const auto* solid = std::get_if<model::Solid>(&collider.shape);
    if ((solid != nullptr) != solids) continue;
    ColliderStep step = stepOf(collider.start, collider.end, index, scene_.substeps, scene_.tickSeconds());
    if (!collider.jointsStart.empty()) {
      const auto at = [&](std::uint32_t substep) {
        return std::make_shared<const model::ClosedMesh>(
            moved(**solid, collider.jointsStart, collider.jointsEnd,
                  static_cast<double>(substep) / scene_.substeps));
      };
      step.meshBefore = at(index);
      step.meshAfter = at(index + 1);
    }
    cloths_[cloth].collide(collider.shape, step, collider.friction, before_[cloth], only);
  }
  cloths_[cloth].finishContacts(before_[cloth]);
}

// Nodes take their ways past the colliders, which stand still meanwhile. What they keep becomes velocity.
void ReferenceSimulation::correct(const CoarseCorrection& level, std::size_t number, const TickInputs& inputs,
                                  std::uint32_t index) {
  const std::uint32_t every = scene_.cloths[number].coarse->every;
  if (index % every != 0) return;
  ReferenceCloth& cloth = cloths_[number];
  const std::vector<Vec3> ways = level.ways(cloth.positions());
  const std::vector<Vec3> start(cloth.positions().begin(), cloth.positions().end());
  const std::vector<Vec3> velocities(cloth.velocities().begin(), cloth.velocities().end());
  for (std::size_t i = 0; i < ways.size(); ++i) {
    cloth.velocities()[i] = cloth.inverseMasses()[i] > 0 ? ways[i] : Vec3::Zero();
    cloth.positions()[i] += cloth.velocities()[i];
  }
  for (const MovingCollider& collider : inputs.colliders) {
    const Pose pose =
        stepOf(collider.start, collider.end, index, scene_.substeps, scene_.tickSeconds()).before;
    cloth.collide(collider.shape, {pose, pose}, 0, start);
  }
  cloth.finishContacts(start);
  const std::uint32_t since = index > 0 ? every : scene_.substeps - (scene_.substeps - 1) / every * every;
  const double rate = 1 / (since * scene_.substepSeconds());
  for (std::size_t i = 0; i < ways.size(); ++i)
    cloth.velocities()[i] = velocities[i] + rate * cloth.velocities()[i];
}

void ReferenceSimulation::boundMotion() {
  std::vector<Vec3> before, positions, velocities;
  std::vector<double> inverseMasses;
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    const ReferenceCloth& cloth = cloths_[i];
    before.insert(before.end(), before_[i].begin(), before_[i].end());
    positions.insert(positions.end(), cloth.positions().begin(), cloth.positions().end());
    velocities.insert(velocities.end(), cloth.velocities().begin(), cloth.velocities().end());
    inverseMasses.insert(inverseMasses.end(), cloth.inverseMasses().begin(), cloth.inverseMasses().end());
  }
  motionBound_.apply(before, positions, velocities, inverseMasses, scene_.substepSeconds());
  auto position = positions.begin();
  auto velocity = velocities.begin();
  for (ReferenceCloth& cloth : cloths_) {
    const auto nodes = static_cast<std::ptrdiff_t>(cloth.nodeCount());
    std::copy_n(position, nodes, cloth.positions().begin());
    std::copy_n(velocity, nodes, cloth.velocities().begin());
    position += nodes;
    velocity += nodes;
  }
}

void ReferenceSimulation::collideWithCloth(const TickInputs& inputs, std::uint32_t index) {
  std::vector<Vec3> positions, velocities;
  std::vector<double> inverseMasses;
  for (const ReferenceCloth& cloth : cloths_) {
    positions.insert(positions.end(), cloth.positions().begin(), cloth.positions().end());
    velocities.insert(velocities.end(), cloth.velocities().begin(), cloth.velocities().end());
    inverseMasses.insert(inverseMasses.end(), cloth.inverseMasses().begin(), cloth.inverseMasses().end());
  }
  const std::vector<std::uint8_t> touched =
      selfCollision_.resolve(positions, velocities, inverseMasses, scene_.substepSeconds());
  std::size_t first = 0;
  for (std::size_t i = 0; i < cloths_.size(); ++i) {
    ReferenceCloth& cloth = cloths_[i];
    const std::size_t nodes = cloth.nodeCount();
    std::copy_n(positions.begin() + static_cast<std::ptrdiff_t>(first), nodes, cloth.positions().begin());
    std::copy_n(velocities.begin() + static_cast<std::ptrdiff_t>(first), nodes, cloth.velocities().begin());
    collide(inputs, index, i, false, std::span(touched).subspan(first, nodes));
    first += nodes;
  }
}

}  // namespace clothstream::reference
