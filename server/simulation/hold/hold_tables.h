// SPDX-License-Identifier: MIT
// What holds a scene's cloth from its start, as the kernels read it.
#pragma once

#include <vector>

#include "server/scene/scene.h"
#include "shaders/hold/hold.h"

namespace clothstream::simulation {

struct HoldTables {
  std::vector<shared::AttachedRecord> attached;
  std::vector<shared::FrameRecord> frames;  // of the attachments, in the order of the cloths, at the start
  // A node of the scene, without slack; none where no cloth has tethers.
  std::vector<shared::TetherRecord> tethers;

  bool empty() const { return attached.empty() && tethers.empty(); }
};

HoldTables holdTables(const scene::Scene& scene);

shared::FrameRecord frameRecord(const scene::Pose& pose);

}  // namespace clothstream::simulation
