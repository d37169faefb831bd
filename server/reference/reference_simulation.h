// SPDX-License-Identifier: MIT
// All cloths of a scene on the CPU in double precision: ticks of substeps, as the kernels do them.
#pragma once

#include <cstdint>
#include <vector>

#include "server/model/scene.h"
#include "server/reference/attachments.h"
#include "server/reference/reference_cloth.h"
#include "server/reference/self_collision.h"

namespace clothstream::reference {

// Moves from start to end over a tick's substeps.
struct MovingCollider {
  model::Shape shape = model::Sphere{};
  Pose start = {}, end = {};
  double friction = 1;  // multiplied with the cloth's
};

struct TickInputs {
  model::Environment environment;
  std::vector<MovingCollider> colliders;
  std::vector<Pose> attachments =
      {};  // at the tick's end, in the order of the cloths; none: where they start
  std::vector<Grab> grabs = {};
};

// The scene's own environment, colliders and attachments over the given tick: from tick * dt to (tick + 1) *
// dt.
TickInputs inputsAt(const model::Scene& scene, std::uint64_t tick);

class ReferenceSimulation {
 public:
  explicit ReferenceSimulation(const model::Scene& scene);

  // One tick.
  void tick(const TickInputs& inputs);
  // The next tick of the scene by itself.
  void tick();

  // Substep `index` of a tick: forces, integration, colliders in order; what holds the cloths;
  // self-collision, and colliders again.
  void substep(const TickInputs& inputs, std::uint32_t index);

  // Ticks done.
  std::uint64_t ticks() const { return ticks_; }
  std::vector<ReferenceCloth>& cloths() { return cloths_; }
  const std::vector<ReferenceCloth>& cloths() const { return cloths_; }
  const Attachments& attachments() const { return attachments_; }

 private:
  void collideWithCloth(const TickInputs& inputs, std::uint32_t index);

  model::Scene scene_;
  std::vector<ReferenceCloth> cloths_;
  Attachments attachments_;
  SelfCollision selfCollision_;
  std::vector<std::vector<Vec3>> before_;  // each cloth's nodes at the start of a substep
  std::uint64_t ticks_ = 0;
};

}  // namespace clothstream::reference
