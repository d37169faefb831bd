// SPDX-License-Identifier: MIT
// Tables of a scene's attachments and tethers.
#pragma once

#include <vector>

#include "server/model/scene.h"
#include "shaders/attachment/attachment.h"

namespace clothstream::simulation {

struct AttachmentTables {
  std::vector<shared::AttachedRecord> attached;
  std::vector<shared::FrameRecord>
      frames;  // poses of the attachments at the start, in the order of the cloths
  // By node of the scene, without slack. Empty if no cloth has tethers.
  std::vector<shared::TetherRecord> tethers;

  bool empty() const { return attached.empty() && tethers.empty(); }
};

// Positions are relative to `origin`.
AttachmentTables attachmentTables(const model::Scene& scene, const model::Vec3& origin);

shared::FrameRecord frameRecord(const model::Pose& pose);

}  // namespace clothstream::simulation
