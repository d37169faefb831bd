// SPDX-License-Identifier: MIT
// Extended position-based dynamics on the device.
#include "server/simulation/xpbd_stage.h"

#include <algorithm>

#include "kernels/correct_grids.h"
#include "kernels/correct_meshes.h"
#include "kernels/finish_corrections.h"
#include "server/model/spring_colours.h"
#include "server/simulation/workgroup_work.h"

namespace clothstream::simulation {
namespace {

using vulkan::Bindings;
using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::uint32_t kAllPasses = 7;

// On a software device barriers cost nothing if the workgroup is no wider than the CPU's vectors, and an
// invocation makes at most 65,535 loop rounds. A cloth in one workgroup saves dispatches (two for a grid, one
// less than the number of colours for a mesh) but leaves all other CPUs idle. With two CPUs the break-even is
// at about these sizes. On a GPU, the kernel of a whole grid needs more registers than RADV has for it.
XpbdCut cutXpbd(const vulkan::Device& device, std::uint32_t workgroupSize,
                std::optional<std::uint32_t> wholeNodes) {
  const std::uint32_t most = device.limits().maxWorkgroupInvocations;
  XpbdCut cut{.wholeWorkgroup = workgroupSize != 0       ? workgroupSize
                                : device.hasGpuKernels() ? 256
                                                         : 8,
              .partWorkgroup = workgroupSize != 0 ? workgroupSize : 64,
              .wholeGridNodes = wholeNodes.value_or(device.hasGpuKernels() ? 0 : 2'048),
              .wholeMeshNodes = wholeNodes.value_or(8'192),
              .rounds = device.isSoftware() ? 65'000 : ~0u};
  cut.wholeWorkgroup = std::min(cut.wholeWorkgroup, most);
  cut.partWorkgroup = std::min(cut.partWorkgroup, most);
  return cut;
}

std::uint64_t threads(const TileRange& tiles, std::uint32_t workgroupSize) {
  return std::uint64_t{tiles.count} * workgroupSize;
}

// All dispatches work on the same positions: each waits for the one before it.
void dispatch(vulkan::Recorder& recorder, const Bindings& bindings, const auto& push, std::uint64_t threads,
              std::uint64_t work) {
  recorder.barrier();
  recorder.dispatch(bindings, push, threads, work);
}

}  // namespace

XpbdStage::Variant XpbdStage::variantOf(std::span<const shared::ClothRecord> cloths, bool colliders) {
  Variant variant{false, false, colliders};
  for (const shared::ClothRecord& cloth : cloths) {
    for (const shared::XpbdSpringRecord& spring : cloth.xpbdSprings)
      variant.damped = variant.damped || spring.damping != 0;
    variant.bend = variant.bend || cloth.xpbdSprings[2].stretch != 0;
  }
  return variant;
}

XpbdStage::XpbdStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                     const StateBuffers& state, std::uint32_t workgroupSize,
                     std::optional<std::uint32_t> wholeNodes)
    : device_(device),
      state_(state),
      cut_(cutXpbd(device, workgroupSize, wholeNodes)),
      tables_(xpbdTables(cloths, cut_)),
      tiles_(device, tables_.tiles),
      colours_(device, tables_.colours),
      links_(device, tables_.links),
      multipliers_(
          device, BufferPurpose::state,
          sizeof(float) * (tables_.iterated ? tables_.gridMultipliers + tables_.links.size() + 1 : 4)) {}

bool XpbdStage::isIn(std::span<const model::Cloth> cloths) {
  return std::ranges::any_of(
      cloths, [](const model::Cloth& cloth) { return cloth.solver.kind == model::SolverKind::xpbd; });
}

void XpbdStage::recordTables(vulkan::Recorder& recorder) {
  for (const DeviceTable* table : {&tiles_, &colours_, &links_}) table->recordUpload(recorder);
}

const StateBindings& XpbdStage::grids(const Variant& variant, std::uint32_t passes) {
  // Corners have no bend springs.
  const bool bend = variant.bend && passes != 1;
  const std::size_t pass = passes == kAllPasses ? 3 : passes / 2;
  std::optional<StateBindings>& made = grids_[pass | (variant.damped ? 4u : 0u) | (bend ? 8u : 0u)];
  if (made) return *made;
  made = bindStates(device_,
                    {device_,
                     kernels::correct_grids,
                     passes == kAllPasses ? cut_.wholeWorkgroup : cut_.partWorkgroup,
                     {variant.damped ? 1u : 0u, tables_.iterated ? 1u : 0u, passes, bend ? 1u : 0u,
                      device_.hasGpuKernels() ? 1u : 0u}},
                    [&](std::size_t from) {
                      const Buffer* to = state_.positions[1 - from];
                      return BufferList{&state_.cloths, &tiles_.texels(), state_.positions[from], to, to,
                                        &multipliers_};
                    });
  return *made;
}

const StateBindings& XpbdStage::meshes(const Variant& variant, bool whole) {
  std::optional<StateBindings>& made = meshes_[(whole ? 1u : 0u) | (variant.damped ? 2u : 0u)];
  if (made) return *made;
  made = bindStates(device_,
                    {device_,
                     kernels::correct_meshes,
                     whole ? cut_.wholeWorkgroup : cut_.partWorkgroup,
                     {variant.damped ? 1u : 0u, tables_.iterated ? 1u : 0u, whole ? 1u : 0u,
                      device_.hasGpuKernels() ? 1u : 0u}},
                    [&](std::size_t from) {
                      const Buffer* to = state_.positions[1 - from];
                      return BufferList{&state_.cloths, &tiles_.texels(),   state_.positions[from], to, to,
                                        &multipliers_,  &colours_.texels(), &links_.texels()};
                    });
  return *made;
}

const StateBindings& XpbdStage::finish(const Variant& variant) {
  std::optional<StateBindings>& made = finish_[variant.colliders ? 1 : 0];
  if (made) return *made;
  made = bindStates(
      device_, {device_, kernels::finish_corrections, cut_.partWorkgroup, {variant.colliders ? 1u : 0u}},
      [&](std::size_t from) {
        const Buffer *to = state_.positions[1 - from], *velocities = state_.velocities[1 - from];
        return BufferList{&state_.cloths,
                          &tiles_.texels(),
                          state_.positions[from],
                          to,
                          &state_.colliders,
                          &state_.nearColliders,
                          to,
                          velocities,
                          velocities,
                          &state_.contactImpulses};
      });
  return *made;
}

void XpbdStage::prepare(std::span<const shared::ClothRecord> cloths) {
  for (const bool colliders : {false, true}) {
    const Variant variant = variantOf(cloths, colliders);
    if (tables_.wholeGrids.count > 0) grids(variant, kAllPasses);
    if (tables_.partGrids[0].count > 0)
      for (std::uint32_t pass = 0; pass < kGridPasses; ++pass) grids(variant, 1u << pass);
    if (tables_.wholeMeshes.count > 0) meshes(variant, true);
    if (!tables_.partMeshes.empty()) meshes(variant, false);
    finish(variant);
  }
}

// Records as many dispatches as the device's limit on loop rounds and the time of a dispatch require.
void XpbdStage::recordWhole(vulkan::Recorder& recorder, std::uint32_t from, const Variant& variant) {
  const std::uint32_t nodes = std::max(1u, tables_.wholeNodes);
  const std::uint32_t each = std::max(1u, std::min(cut_.rounds / std::max(1u, tables_.roundsPerIteration),
                                                   nodesPerDispatch(device_) / nodes));
  for (std::uint32_t first = 0; first < tables_.wholeIterations; first += each) {
    shared::XpbdPush push{};
    push.firstMultiplier = tables_.gridMultipliers;
    push.firstIteration = first;
    push.endIteration = first + std::min(each, tables_.wholeIterations - first);
    const std::uint64_t work =
        workPerInvocation(std::uint64_t{nodes} * (push.endIteration - first), cut_.wholeWorkgroup);
    if (tables_.wholeGrids.count > 0) {
      push.firstTile = tables_.wholeGrids.first;
      dispatch(recorder, grids(variant, kAllPasses)[from], push,
               threads(tables_.wholeGrids, cut_.wholeWorkgroup), work);
    }
    if (tables_.wholeMeshes.count > 0) {
      push.firstTile = tables_.wholeMeshes.first;
      dispatch(recorder, meshes(variant, true)[from], push, threads(tables_.wholeMeshes, cut_.wholeWorkgroup),
               work);
    }
  }
}

void XpbdStage::recordParts(vulkan::Recorder& recorder, std::uint32_t from, const Variant& variant) {
  shared::XpbdPush push{};
  push.firstMultiplier = tables_.gridMultipliers;
  for (; push.firstIteration < tables_.partGridIterations; ++push.firstIteration)
    for (std::uint32_t pass = 0; pass < kGridPasses; ++pass) {
      push.endIteration = push.firstIteration + 1;
      push.firstTile = tables_.partGrids[pass].first;
      dispatch(recorder, grids(variant, 1u << pass)[from], push,
               threads(tables_.partGrids[pass], cut_.partWorkgroup), model::kBlock * model::kBlock);
    }
  for (const XpbdTables::PartMesh& mesh : tables_.partMeshes) {
    push.cloth = mesh.cloth;
    for (push.firstIteration = 0; push.firstIteration < mesh.iterations; ++push.firstIteration)
      for (const TileRange& colour : mesh.colours) {
        push.firstSpring = colour.first;
        push.springs = colour.count;
        dispatch(recorder, meshes(variant, false)[from], push, colour.count, 1);
      }
  }
}

void XpbdStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const Tick& tick = substep.tick;
  const Variant variant = variantOf(tick.cloths, substep.collision.colliderCount > 0);
  recordWhole(recorder, substep.from, variant);
  recordParts(recorder, substep.from, variant);
  shared::FinishPush push{.collision = substep.collision,
                          .substepSeconds = static_cast<float>(tick.substepSeconds),
                          .substepRate = tick.rate * static_cast<float>(tick.substeps),
                          .firstTile = 0,
                          .reserved = 0};
  const std::uint32_t most = device_.limits().maxDispatchX;
  for (std::uint32_t done = 0; done < tables_.nodes.count; done += most) {
    push.firstTile = tables_.nodes.first + done;
    dispatch(recorder, finish(variant)[substep.from], push,
             std::uint64_t{std::min(most, tables_.nodes.count - done)} * cut_.partWorkgroup,
             push.collision.nodeWork);
  }
}

}  // namespace clothstream::simulation
