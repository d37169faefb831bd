// SPDX-License-Identifier: MIT
// What holds a scene's cloth from its start, as the kernels read it.
#pragma once

#include <vector>

#include "server/model/scene.h"
#include "shaders/attachment/attachment.h"

namespace clothstream::simulation {

struct AttachmentTables {
  std::vector<shared::AttachedRecord> attached;
  std::vector<shared::FrameRecord> frames;  // of the attachments, in the order of the cloths, at the start
  // A node of the scene, without slack; none where no cloth has tethers.
  std::vector<shared::TetherRecord> tethers;

  bool empty() const { return attached.empty() && tethers.empty(); }
};

AttachmentTables attachmentTables(const model::Scene& scene);

shared::FrameRecord frameRecord(const model::Pose& pose);

}  // namespace clothstream::simulation
