// SPDX-License-Identifier: MIT
#include "server/simulation/collision/solid_stage.h"

#include "kernels/collide_solids.h"
#include "server/model/price.h"

namespace clothstream::simulation {

using vulkan::kStorage;
using vulkan::kTexels;

SolidStage::SolidStage(const vulkan::Device& device, const SolidTables& tables,
                       std::span<const model::Cloth> cloths, const StateBuffers& state,
                       std::uint32_t workgroupSize)
    : workgroupSize_(workgroupSize),
      tileCount_(static_cast<std::uint32_t>(nodeTiles(cloths, workgroupSize).size())),
      solids_(device, tables.texels),
      tiles_(device, nodeTiles(cloths, workgroupSize)),
      collide_(device,
               {.name = "collide_solids",
                .spirv = kernels::collide_solids,
                .bindings = {kTexels, kTexels, kTexels, kTexels, kStorage, kStorage, kStorage, kTexels},
                .pushConstantBytes = sizeof(shared::SolidPush),
                .workgroupSize = workgroupSize,
                .specialisation = {}},
               {&state.cloths, &tiles_.texels(), &solids_.texels(), state.positions[0], state.positions[1],
                state.velocities[1], &state.contactImpulses, &state.colliders},
               {&state.cloths, &tiles_.texels(), &solids_.texels(), state.positions[1], state.positions[0],
                state.velocities[0], &state.contactImpulses, &state.colliders}) {}

void SolidStage::recordTables(vulkan::Recorder& recorder) const {
  solids_.recordUpload(recorder);
  tiles_.recordUpload(recorder);
}

void SolidStage::record(vulkan::Recorder& recorder, std::uint32_t present,
                        const shared::CollisionPush& collision, std::uint32_t solidCount) const {
  recorder.barrier();
  recorder.dispatch(
      collide_.from[present],
      shared::SolidPush{
          .collision = collision, .solidCount = solidCount, .reserved0 = 0, .reserved1 = 0, .reserved2 = 0},
      std::uint64_t{tileCount_} * workgroupSize_,
      1 + solidCount * static_cast<std::uint64_t>(model::kSolidWork));
}

}  // namespace clothstream::simulation
