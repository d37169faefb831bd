// SPDX-License-Identifier: MIT
// Tables of the cloths of a scene that follow joints.
#pragma once

#include <cstdint>
#include <vector>

#include "server/model/scene.h"
#include "server/model/skin.h"
#include "shaders/cloth_skin/cloth_skin.h"

namespace clothstream::simulation {

struct ClothSkinTables {
  struct Skinned {
    model::Solid solid;  // shape of the collider whose joints the cloth follows
    shared::PlacePush push = {};
    std::uint32_t nodeCount = 0;
    std::vector<model::JointFrame> inverseRests;
    std::vector<model::Pose> rest;  // of the joints, in the frame of the collider
    model::Pose start;              // of the collider, relative to the origin
  };
  std::vector<Skinned> cloths;
  std::vector<shared::SkinnedRecord> nodes;  // of each cloth those with limits, the exact ones, the free ones
  std::uint32_t limitCount = 0;              // nodes with limits of all cloths
  // Joints of all cloths, three times: before a jump, at a tick's start and at its end.
  std::uint32_t transformCount = 0;
  bool hasBackstops = false;

  bool empty() const { return cloths.empty(); }
};
// Poses are relative to `origin`.
ClothSkinTables clothSkinTables(const model::Scene& scene, const model::Vec3& origin);

}  // namespace clothstream::simulation
