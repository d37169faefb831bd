// SPDX-License-Identifier: MIT
// Measures the cloths at a tick's end, on the device.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "server/model/scene.h"
#include "server/simulation/cloth_report.h"
#include "server/simulation/collision/solid_stage.h"
#include "server/simulation/state_bindings.h"
#include "server/simulation/state_buffers.h"
#include "server/vulkan/buffer.h"
#include "server/vulkan/device.h"
#include "server/vulkan/recorder.h"
#include "shaders/collision/collision.h"
#include "shaders/report/report.h"
#include "shaders/shared/simulation.h"

namespace clothstream::simulation {

// The springs of meshes by node; null if no cloth is a mesh.
struct MeshSprings {
  const vulkan::Buffer* nodes = nullptr;
  const vulkan::Buffer* ends = nullptr;
};

// Stiffness of each kind of spring of a cloth, N/m, also of springs that are constraints.
struct SpringStiffness {
  float structural, shear, bend;
};
std::vector<SpringStiffness> springStiffness(std::span<const model::Cloth> cloths);

// Partition of cloths into blocks.
struct ReportBlocks {
  std::vector<shared::ReportBlockRecord> records;
  std::vector<shared::ReportClothRecord> cloths;  // without their stiffness
};

// Belongs to the device's thread. Recordings without a report cost nothing. The bits depend neither on the
// workgroup's size nor on the device.
class ReportStage {
 public:
  // `cloths` have the nodes of each cloth. `solids` has the triangle meshes of colliders, or is null.
  // `workgroupSize` 0: the measured best for the device.
  ReportStage(const vulkan::Device& device, std::span<const shared::ClothRecord> cloths,
              const StateBuffers& state, const MeshSprings& meshes, const SolidStage* solids,
              std::uint32_t workgroupSize);

  // Measures the state in the buffers `present` against the colliders at the end of `collision`, and
  // `solidCount` meshes. Begins with a barrier. At most one such recording may be in flight.
  void record(vulkan::Recorder& recorder, std::uint32_t present, std::span<const SpringStiffness> stiffness,
              const model::Vec3& gravity, const model::Vec3& origin, const shared::CollisionPush& collision,
              std::uint32_t solidCount);
  // Reports of a complete recording, one per cloth, without the values of a solve.
  std::vector<ClothReport> collect() const;

 private:
  ReportStage(const vulkan::Device& device, ReportBlocks blocks, const StateBuffers& state,
              const MeshSprings& meshes, const SolidStage* solids, std::uint32_t workgroupSize);

  std::uint32_t workgroupSize_;
  std::uint32_t slot_ = 0;
  bool tabled_ = false;  // the blocks are on the device
  ReportBlocks of_;
  vulkan::Buffer blockUpload_, blocks_, cloths_, runs_, sums_, counts_, readback_;
  std::array<vulkan::Buffer, 2>
      clothUploads_;  // used alternately: a recording may be in flight while the next one is made
  StateBindings measure_, penetrations_;
  vulkan::Bindings addUp_;
  std::optional<StateBindings> solidDepths_;  // absent if no collider is a triangle mesh
};

}  // namespace clothstream::simulation
