// SPDX-License-Identifier: MIT
// All cloths of a scene on the CPU in double precision: the ticks and substeps of the kernels.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/reference/attachments.h"
#include "server/reference/cloth_skins.h"
#include "server/reference/coarse_correction.h"
#include "server/reference/motion_bound.h"
#include "server/reference/reference_cloth.h"
#include "server/reference/self_collision.h"

namespace clothstream::reference {

// Moves from start to end over a tick's substeps.
struct MovingCollider {
  model::Shape shape = model::Sphere{};
  Pose start = {}, end = {};
  double friction = 1;  // multiplied with the cloth's
  // Poses of the joints of a mesh in the frame of the collider, or empty.
  std::vector<model::Pose> jointsStart = {}, jointsEnd = {};
  // True: it or its joints jumped to the tick's start, from `before` and `jointsBefore`.
  bool jumped = false;
  Pose before = {};
  std::vector<model::Pose> jointsBefore = {};
};

struct TickInputs {
  model::Environment environment;
  std::vector<MovingCollider> colliders;
  std::vector<Pose> attachments = {};  // at the tick's end, in the order of the cloths; empty: the start
  std::vector<Grab> grabs = {};
  std::vector<Carry> carries = {};
  std::vector<model::LocalWind> winds = {};
  std::vector<PlacedSurface> surfaces = {};
};

// Environment, local winds, colliders and attachments of the scene itself in a tick: from tick * dt to (tick
// + 1) * dt.
TickInputs inputsAt(const model::Scene& scene, std::uint64_t tick);

class ReferenceSimulation {
 public:
  explicit ReferenceSimulation(const model::Scene& scene);

  // Simulates one tick.
  void tick(const TickInputs& inputs);
  // Simulates the next tick with the scene's own inputs.
  void tick();

  // Simulates substep `index` of a tick: coarse corrections; forces, integration and colliders in order;
  // attachments, tethers and grabs; self-collision, and colliders again; colliders that are triangle meshes;
  // surfaces of the real room; limits of skinned cloth; the bound on motion.
  void substep(const TickInputs& inputs, std::uint32_t index);

  // Number of simulated ticks.
  std::uint64_t ticks() const { return ticks_; }
  std::vector<ReferenceCloth>& cloths() { return cloths_; }
  const std::vector<ReferenceCloth>& cloths() const { return cloths_; }
  const Attachments& attachments() const { return attachments_; }

 private:
  // Collides nodes with the colliders that are solids, or with the others. If `only` is not empty, it has a 1
  // for each node that collides.
  void collide(const TickInputs& inputs, std::uint32_t index, std::size_t cloth, bool solids,
               std::span<const std::uint8_t> only = {});
  void correct(const CoarseCorrection& level, std::size_t cloth, const TickInputs& inputs,
               std::uint32_t index);
  void collideWithCloth(const TickInputs& inputs, std::uint32_t index);
  void boundMotion();

  model::Scene scene_;
  std::vector<ReferenceCloth> cloths_;
  Attachments attachments_;
  ClothSkins skins_;
  SelfCollision selfCollision_;
  MotionBound motionBound_;
  std::vector<std::vector<CoarseCorrection>> coarse_;  // by cloth and level
  std::vector<std::vector<Vec3>> before_;              // each cloth's nodes at the start of a substep
  std::uint64_t ticks_ = 0;
};

}  // namespace clothstream::reference
