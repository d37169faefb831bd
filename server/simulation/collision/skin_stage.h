// SPDX-License-Identifier: MIT
// Moves the vertices of meshes by their joints, once in each tick.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "server/simulation/collision/moving_collider.h"
#include "server/simulation/collision/solid_tables.h"
#include "server/simulation/device_table.h"
#include "server/simulation/stage.h"
#include "server/vulkan/kernel.h"
#include "server/vulkan/recorder.h"

namespace clothstream::simulation {

// Rest vertices, and the triangles around them, as the kernels read them.
struct SkinTables {
  struct Skinned {
    std::uint32_t solid = 0;  // index in SolidTables
    shared::SkinPush push = {};
    model::SkinBounds bounds;
    std::vector<model::JointFrame> inverseRests;
    std::vector<model::Pose> rest;  // of the joints, in the frame of the collider
  };
  std::vector<Skinned> skinned;
  std::vector<shared::SkinVertexRecord> rests;
  std::vector<shared::vec4> fans;    // of each vertex: first texel and count; then FanRecords
  std::uint32_t transformCount = 0;  // of all joints, at the start and at the end of a tick

  bool empty() const { return skinned.empty(); }
};
SkinTables skinTables(const SolidTables& solids);

class SkinStage final : public Stage {
 public:
  // `solids` outlives the stage. The buffer `texels` has its texels.
  SkinStage(const vulkan::Device& device, SkinTables tables, SolidTables& solids,
            const vulkan::Buffer& texels, std::uint32_t workgroupSize);

  // Uploads the joints of the colliders, and sets the reach and the motion of their meshes in the tables,
  // which CollisionStage reads. A mesh with joints belongs to one collider. Allocates nothing.
  void recordInputs(vulkan::Recorder& recorder, const Tick& tick) override;
  // Moves vertices, their normals and the boxes of the trees. Stage "skins".
  void recordStart(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present) override;

 private:
  void recordTables(vulkan::Recorder& recorder) override;
  void recordRefit(vulkan::Recorder& recorder, const SkinTables::Skinned& skinned, bool upperLevels) const;

  SkinTables tables_;
  SolidTables& solids_;
  DeviceTable rests_, fans_;
  vulkan::Buffer transformTexels_;
  std::array<vulkan::Buffer, 2> uploads_;  // by Tick::slot: a tick may be in flight
  bool moves_ = false;                     // a collider of the tick has one of the meshes
  std::vector<model::Transform>
      transforms_;  // of the joints of one mesh, at the start and at the end of a tick
  vulkan::Bindings skin_, weigh_, refit_;
};

}  // namespace clothstream::simulation
