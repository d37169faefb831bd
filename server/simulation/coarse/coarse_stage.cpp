// SPDX-License-Identifier: MIT
#include "server/simulation/coarse/coarse_stage.h"

#include <algorithm>

#include "kernels/average_nodes.h"
#include "kernels/average_rows.h"
#include "kernels/hold_links.h"
#include "kernels/move_grid.h"
#include "kernels/move_mesh.h"
#include "server/model/coarse_level.h"

namespace clothstream::simulation {
namespace {

static_assert(model::kMaxCoarseNodes == CLOTHSTREAM_COARSE_NODES);

// Invocations that hold the links of a cloth. A software device runs eight at a time, and barriers between
// more cost most of its time.
constexpr std::uint32_t kGpuHoldLanes = 64, kCpuHoldLanes = 8;
// Rows that an invocation moves of a column of a grid.
constexpr std::uint32_t kGpuRows = 1, kCpuRows = 8;

// Work of an invocation (vulkan::Recorder::dispatch).
constexpr std::uint32_t kAverageWork = 8, kHoldWork = 64, kMoveMeshWork = 1;

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
      averageNodes_(
          bindStates(device, {device, kernels::average_nodes, workgroupSize},
                     [&](std::size_t from) {
                       return BufferList{&nodes_.texels(), &means_.texels(), state.positions[from], &parts_};
                     })),
      averageRows_(bindStates(device, {device, kernels::average_rows, workgroupSize},
                              [&](std::size_t from) {
                                return BufferList{state.positions[from], &parts_};
                              })),
      hold_(bindStates(device,
                       {device, kernels::hold_links, device.hasGpuKernels() ? kGpuHoldLanes : kCpuHoldLanes},
                       [&](std::size_t from) {
                         return BufferList{&nodes_.texels(),   &parts_,          &means_.texels(),
                                           &colours_.texels(), &links_.texels(), state.positions[from],
                                           &corrections_};
                       })),
      moves_{bindMoves(device, state, workgroupSize, false), bindMoves(device, state, workgroupSize, true)} {}

CoarseStage::Moves CoarseStage::bindMoves(const vulkan::Device& device, const StateBuffers& state,
                                          std::uint32_t workgroupSize, bool colliders) const {
  const std::uint32_t collides = colliders ? 1 : 0;
  const auto buffers = [&](std::size_t from) {
    const vulkan::Buffer *positions = state.positions[from], *velocities = state.velocities[from];
    return BufferList{&shares_.texels(),
                      &corrections_,
                      positions,
                      velocities,
                      positions,
                      velocities,
                      &state.colliders,
                      &state.nearColliders,
                      &state.contactImpulses};
  };
  return {bindStates(device, {device, kernels::move_mesh, workgroupSize, {collides}}, buffers),
          bindStates(device, {device, kernels::move_grid, workgroupSize, {collides, rows_}}, buffers)};
}

bool CoarseStage::isIn(std::span<const model::Cloth> cloths) {
  return std::ranges::any_of(cloths, [](const model::Cloth& cloth) { return cloth.coarse.has_value(); });
}

void CoarseStage::recordTables(vulkan::Recorder& recorder) {
  for (const DeviceTable* table : {&nodes_, &means_, &shares_, &colours_, &links_})
    table->recordUpload(recorder);
}

void CoarseStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const Tick& tick = substep.tick;
  for (const CoarseTables::Level& level : levels_) {
    if (substep.index % level.every != 0) continue;
    // The last correction of a tick may be fewer substeps before the next one.
    const std::uint32_t since =
        substep.index > 0 ? level.every : tick.substeps - (tick.substeps - 1) / level.every * level.every;
    shared::CoarsePush push = level.push;
    push.velocityRate = static_cast<float>(1 / (since * tick.substepSeconds));
    push.thickness = tick.cloths[level.cloth].thickness;
    push.collision = {.colliderCount = substep.collision.colliderCount,
                      .progressBefore = substep.collision.progressBefore,
                      .progressAfter = substep.collision.progressBefore,
                      .tickRate = 0,
                      .substepRate = 0,
                      .contactClothCount = 0,
                      .nodeWork = substep.collision.nodeWork,
                      .substepSeconds = 0};
    recorder.barrier();
    recordLevel(recorder, substep.from, push);
  }
}

void CoarseStage::recordLevel(vulkan::Recorder& recorder, std::uint32_t present,
                              const shared::CoarsePush& push) const {
  const bool isGrid = push.rows > 0;
  const bool collides = push.collision.colliderCount > 0;
  const Moves& moves = moves_[collides ? 1 : 0];
  const std::uint64_t colliding = collides ? push.collision.nodeWork : 0;
  const std::uint64_t sums =
      isGrid ? std::uint64_t{push.rows} * push.coarseColumns : std::uint64_t{push.coarseCount} * push.parts;
  recorder.dispatch((isGrid ? averageRows_ : averageNodes_)[present], push, sums, kAverageWork);
  recorder.barrier();
  recorder.dispatch(hold_[present], push, hold_[present].kernel().workgroupSize(), kHoldWork);
  recorder.barrier();
  if (!isGrid) {
    recorder.dispatch(moves.mesh[present], push, push.nodeCount, kMoveMeshWork + colliding);
    return;
  }
  const std::uint64_t strips = (push.rows + rows_ - 1) / rows_;
  recorder.dispatch(moves.grid[present], push, strips * push.columns, (rows_ + 1) / 2 + rows_ * colliding);
}

}  // namespace clothstream::simulation
