// SPDX-License-Identifier: MIT
// Masses that change while a scene runs.
#include "server/simulation/mass_stage.h"

#include <algorithm>
#include <utility>

#include "kernels/set_masses.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/state_bindings.h"

namespace clothstream::simulation {
namespace {

constexpr std::uint32_t kWorkgroup = 64;

std::vector<float> massesOf(std::span<const model::Cloth> cloths) {
  std::vector<float> masses;
  for (const model::Cloth& cloth : cloths) masses.push_back(cloth.mass);
  return masses;
}

}  // namespace

MassStage::MassStage(const vulkan::Device& device, std::span<const model::Cloth> cloths,
                     const StateMemory& state)
    : device_(device),
      state_(state),
      masses_(massesOf(cloths)),
      inverseMasses_(simulation::inverseMasses(cloths)) {}

void MassStage::prepare(std::span<const model::Cloth> cloths) {
  if (!bindings_.empty() || massesOf(cloths) == masses_) return;
  vulkan::Buffer upload(device_, vulkan::BufferPurpose::upload, inverseMasses_.size() * sizeof(float));
  std::ranges::copy(inverseMasses_, upload.mapped<float>().begin());
  const vulkan::Kernel kernel(device_, kernels::set_masses, kWorkgroup);
  std::vector<vulkan::Bindings> bindings;
  for (const vulkan::Buffer* positions :
       {&state_.positions[0], &state_.positions[1], &state_.checkpointPositions})
    bindings.emplace_back(device_, kernel, BufferList{&upload, positions});
  upload_ = std::move(upload);
  bindings_ = std::move(bindings);
}

void MassStage::setCloths(std::span<const model::Cloth> cloths) {
  std::vector<float> masses = massesOf(cloths);
  if (masses == masses_) return;
  masses_ = std::move(masses);
  inverseMasses_ = simulation::inverseMasses(cloths);
  std::ranges::copy(inverseMasses_, upload_.mapped<float>().begin());
  outdate();
}

// Without bindings no mass has changed, and the start state has the right ones.
void MassStage::recordTables(vulkan::Recorder& recorder) {
  for (const vulkan::Bindings& bindings : bindings_) recorder.dispatch(bindings, inverseMasses_.size());
}

}  // namespace clothstream::simulation
