// SPDX-License-Identifier: MIT
// Dihedral bending on the device.
#include "server/simulation/bending/bending_stage.h"

#include <algorithm>

#include "kernels/bend_nodes.h"
#include "kernels/measure_hinges.h"

namespace clothstream::simulation {
namespace {

using vulkan::kStorage;
using vulkan::kTexels;

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
      measure_(device,
               {.name = "measure_hinges",
                .spirv = kernels::measure_hinges,
                .bindings = {kTexels, kTexels, kTexels, kStorage},
                .pushConstantBytes = sizeof(shared::BendingPush),
                .workgroupSize = workgroupSize},
               {&state.cloths, &hinges_.texels(), state.positions[0], &forces_},
               {&state.cloths, &hinges_.texels(), state.positions[1], &forces_}),
      bend_(device,
            {.name = "bend_nodes",
             .spirv = kernels::bend_nodes,
             .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage},
             .pushConstantBytes = sizeof(shared::BendingPush),
             .workgroupSize = workgroupSize},
            {&incidences_.texels(), &lists_.texels(), &forces_, state.positions[0], state.velocities[0]},
            {&incidences_.texels(), &lists_.texels(), &forces_, state.positions[1], state.velocities[1]}) {}

bool BendingStage::isIn(std::span<const model::Cloth> cloths) {
  return std::ranges::any_of(cloths, [](const model::Cloth& cloth) { return cloth.dihedralBending > 0; });
}

bool BendingStage::serves(std::span<const model::Cloth> cloths) const {
  for (std::size_t i = 0; i < cloths.size(); ++i)
    if (cloths[i].dihedralBending > 0 && !bends_[i]) return false;
  return true;
}

void BendingStage::recordTables(vulkan::Recorder& recorder) const {
  for (const DeviceTable* table : {&hinges_, &incidences_, &lists_}) table->recordUpload(recorder);
}

void BendingStage::record(vulkan::Recorder& recorder, std::uint32_t present, double substepSeconds) const {
  shared::BendingPush push{hingeCount_, static_cast<float>(substepSeconds)};
  recorder.dispatch(measure_.from[present], push, hingeCount_, 1);
  recorder.barrier();
  push.count = nodeCount_;
  recorder.dispatch(bend_.from[present], push, nodeCount_, kBendWork);
}

}  // namespace clothstream::simulation
