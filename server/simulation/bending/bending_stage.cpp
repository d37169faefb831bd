// SPDX-License-Identifier: MIT
// Dihedral bending on the device.
#include "server/simulation/bending/bending_stage.h"

#include <algorithm>

#include "kernels/bend_nodes.h"
#include "kernels/measure_hinges.h"

namespace clothstream::simulation {
namespace {

// Work of a node (vulkan::Recorder::dispatch), which gathers from its hinges.
constexpr std::uint32_t kBendWork = 4;

std::vector<bool> bending(std::span<const model::Cloth> cloths) {
  std::vector<bool> bends;
  for (const model::Cloth& cloth : cloths) bends.push_back(cloth.dihedralBending > 0);
  return bends;
}

}  // namespace

BendingStage::BendingStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                           const StateBuffers& state, std::uint32_t workgroupSize)
    : BendingStage(device, bendingTables(cloths), cloths, state, workgroupSize) {}

BendingStage::BendingStage(const vulkan::Device& device, const BendingTables& tables,
                           std::span<const model::Cloth> cloths, const StateBuffers& state,
                           std::uint32_t workgroupSize)
    : bends_(bending(cloths)),
      hingeCount_(static_cast<std::uint32_t>(tables.hinges.size())),
      nodeCount_(static_cast<std::uint32_t>(tables.incidences.size())),
      hinges_(device, tables.hinges),
      incidences_(device, tables.incidences),
      lists_(device, tables.lists),
      forces_(device, vulkan::BufferPurpose::texels,
              std::max<std::size_t>(1, tables.hinges.size()) * 4 * sizeof(shared::vec4)),
      measure_(
          bindStates(device, {device, kernels::measure_hinges, workgroupSize},
                     [&](std::size_t from) {
                       return BufferList{&state.cloths, &hinges_.texels(), state.positions[from], &forces_};
                     })),
      bend_(bindStates(device, {device, kernels::bend_nodes, workgroupSize}, [&](std::size_t from) {
        return BufferList{&incidences_.texels(), &lists_.texels(), &forces_, state.positions[from],
                          state.velocities[from]};
      })) {}

bool BendingStage::isIn(std::span<const model::Cloth> cloths) {
  return std::ranges::any_of(cloths, [](const model::Cloth& cloth) { return cloth.dihedralBending > 0; });
}

bool BendingStage::serves(std::span<const model::Cloth> cloths) const {
  for (std::size_t i = 0; i < cloths.size(); ++i)
    if (cloths[i].dihedralBending > 0 && !bends_[i]) return false;
  return true;
}

void BendingStage::recordTables(vulkan::Recorder& recorder) {
  for (const DeviceTable* table : {&hinges_, &incidences_, &lists_}) table->recordUpload(recorder);
}

void BendingStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  shared::BendingPush push{hingeCount_, static_cast<float>(substep.tick.substepSeconds)};
  recorder.barrier();
  recorder.dispatch(measure_[substep.from], push, hingeCount_, 1);
  recorder.barrier();
  push.count = nodeCount_;
  recorder.dispatch(bend_[substep.from], push, nodeCount_, kBendWork);
}

}  // namespace clothstream::simulation
