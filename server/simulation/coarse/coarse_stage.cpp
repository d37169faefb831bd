// SPDX-License-Identifier: MIT
#include "server/simulation/coarse/coarse_stage.h"

#include <algorithm>
#include <utility>

#include "kernels/average_nodes.h"
#include "kernels/average_rows.h"
#include "kernels/hold_links.h"
#include "kernels/move_grid.h"
#include "kernels/move_mesh.h"
#include "server/model/coarse_level.h"

namespace clothstream::simulation {
namespace {

using vulkan::kStorage;
using vulkan::kTexels;

static_assert(model::kMaxCoarseNodes == CLOTHSTREAM_COARSE_NODES);

// Invocations that hold the links of a cloth. A software device runs eight at a time, and barriers between
// more cost most of its time.
constexpr std::uint32_t kGpuHoldLanes = 64, kCpuHoldLanes = 8;
// Rows that an invocation moves of a column of a grid.
constexpr std::uint32_t kGpuRows = 1, kCpuRows = 8;

// Work of an invocation (vulkan::Recorder::dispatch).
constexpr std::uint32_t kAverageWork = 8, kHoldWork = 64, kMoveMeshWork = 1;

const std::vector<vulkan::BindingKind> kMoved{kTexels,  kTexels, kTexels, kTexels, kStorage,
                                              kStorage, kTexels, kTexels, kStorage};

vulkan::KernelDescription kernelOf(const char* name, std::span<const std::uint32_t> spirv,
                                   std::uint32_t workgroupSize, std::vector<vulkan::BindingKind> bindings,
                                   std::vector<std::uint32_t> specialisation = {}) {
  return {.name = name,
          .spirv = spirv,
          .bindings = std::move(bindings),
          .pushConstantBytes = sizeof(shared::CoarsePush),
          .workgroupSize = workgroupSize,
          .specialisation = std::move(specialisation)};
}

vulkan::Buffer texels(const vulkan::Device& device, std::size_t count) {
  return {device, vulkan::BufferPurpose::texels, std::max<std::size_t>(1, count) * sizeof(shared::vec4)};
}

}  // namespace

CoarseStage::CoarseStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                         const StateBuffers& state, std::uint32_t workgroupSize)
    : CoarseStage(device, coarseTables(cloths), state, workgroupSize) {}

CoarseStage::CoarseStage(const vulkan::Device& device, const CoarseTables& tables, const StateBuffers& state,
                         std::uint32_t workgroupSize)
    : levels_(tables.levels),
      rows_(device.hasGpuKernels() ? kGpuRows : kCpuRows),
      nodes_(device, tables.nodes),
      means_(device, tables.means),
      shares_(device, tables.shares),
      colours_(device, tables.colours),
      links_(device, tables.links),
      parts_(texels(device, tables.parts)),
      corrections_(texels(device, tables.nodes.size())),
      averageNodes_(device,
                    kernelOf("average_nodes", kernels::average_nodes, workgroupSize,
                             {kTexels, kTexels, kTexels, kStorage}),
                    {&nodes_.texels(), &means_.texels(), state.positions[0], &parts_},
                    {&nodes_.texels(), &means_.texels(), state.positions[1], &parts_}),
      averageRows_(device,
                   kernelOf("average_rows", kernels::average_rows, workgroupSize, {kTexels, kStorage}),
                   {state.positions[0], &parts_}, {state.positions[1], &parts_}),
      hold_(
          device,
          kernelOf("hold_links", kernels::hold_links, device.hasGpuKernels() ? kGpuHoldLanes : kCpuHoldLanes,
                   {kTexels, kTexels, kTexels, kTexels, kTexels, kTexels, kStorage}),
          {&nodes_.texels(), &parts_, &means_.texels(), &colours_.texels(), &links_.texels(),
           state.positions[0], &corrections_},
          {&nodes_.texels(), &parts_, &means_.texels(), &colours_.texels(), &links_.texels(),
           state.positions[1], &corrections_}),
      moves_{Moves(device, shares_.texels(), corrections_, state, workgroupSize, rows_, false),
             Moves(device, shares_.texels(), corrections_, state, workgroupSize, rows_, true)} {}

CoarseStage::Moves::Moves(const vulkan::Device& device, const vulkan::Buffer& shares,
                          const vulkan::Buffer& corrections, const StateBuffers& state,
                          std::uint32_t workgroupSize, std::uint32_t rows, bool colliders)
    : mesh(device, kernelOf("move_mesh", kernels::move_mesh, workgroupSize, kMoved, {colliders ? 1u : 0u}),
           {&shares, &corrections, state.positions[0], state.velocities[0], state.positions[0],
            state.velocities[0], &state.colliders, &state.nearColliders, &state.contactImpulses},
           {&shares, &corrections, state.positions[1], state.velocities[1], state.positions[1],
            state.velocities[1], &state.colliders, &state.nearColliders, &state.contactImpulses}),
      grid(device,
           kernelOf("move_grid", kernels::move_grid, workgroupSize, kMoved, {colliders ? 1u : 0u, rows}),
           {&shares, &corrections, state.positions[0], state.velocities[0], state.positions[0],
            state.velocities[0], &state.colliders, &state.nearColliders, &state.contactImpulses},
           {&shares, &corrections, state.positions[1], state.velocities[1], state.positions[1],
            state.velocities[1], &state.colliders, &state.nearColliders, &state.contactImpulses}) {}

bool CoarseStage::isIn(std::span<const model::Cloth> cloths) {
  return std::ranges::any_of(cloths, [](const model::Cloth& cloth) { return cloth.coarse.has_value(); });
}

void CoarseStage::recordTables(vulkan::Recorder& recorder) const {
  for (const DeviceTable* table : {&nodes_, &means_, &shares_, &colours_, &links_})
    table->recordUpload(recorder);
}

bool CoarseStage::record(vulkan::Recorder& recorder, std::uint32_t present, const Substep& substep,
                         const shared::CollisionPush& collision,
                         std::span<const shared::ClothRecord> cloths) const {
  bool any = false;
  for (const CoarseTables::Level& level : levels_) {
    if (substep.index % level.every != 0) continue;
    // The last correction of a tick may be fewer substeps before the next one.
    const std::uint32_t since =
        substep.index > 0 ? level.every : substep.count - (substep.count - 1) / level.every * level.every;
    shared::CoarsePush push = level.push;
    push.velocityRate = static_cast<float>(1 / (since * substep.seconds));
    push.thickness = cloths[level.cloth].thickness;
    push.collision = {.colliderCount = collision.colliderCount,
                      .progressBefore = collision.progressBefore,
                      .progressAfter = collision.progressBefore,
                      .tickRate = 0,
                      .substepRate = 0,
                      .contactClothCount = 0,
                      .nodeWork = collision.nodeWork,
                      .substepSeconds = 0};
    if (any) recorder.barrier();
    recordLevel(recorder, present, push);
    any = true;
  }
  return any;
}

void CoarseStage::recordLevel(vulkan::Recorder& recorder, std::uint32_t present,
                              const shared::CoarsePush& push) const {
  const bool isGrid = push.rows > 0;
  const bool collides = push.collision.colliderCount > 0;
  const Moves& moves = moves_[collides ? 1 : 0];
  const std::uint64_t colliding = collides ? push.collision.nodeWork : 0;
  const std::uint64_t sums =
      isGrid ? std::uint64_t{push.rows} * push.coarseColumns : std::uint64_t{push.coarseCount} * push.parts;
  recorder.dispatch((isGrid ? averageRows_ : averageNodes_).from[present], push, sums, kAverageWork);
  recorder.barrier();
  recorder.dispatch(hold_.from[present], push, hold_.kernel.workgroupSize(), kHoldWork);
  recorder.barrier();
  if (!isGrid) {
    recorder.dispatch(moves.mesh.from[present], push, push.nodeCount, kMoveMeshWork + colliding);
    return;
  }
  const std::uint64_t strips = (push.rows + rows_ - 1) / rows_;
  recorder.dispatch(moves.grid.from[present], push, strips * push.columns,
                    (rows_ + 1) / 2 + rows_ * colliding);
}

}  // namespace clothstream::simulation
