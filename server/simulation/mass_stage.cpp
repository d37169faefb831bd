// SPDX-License-Identifier: MIT
// Masses that change while a scene runs.
#include "server/simulation/mass_stage.h"

#include <algorithm>
#include <cassert>

#include "kernels/set_masses.h"

namespace clothstream::simulation {

namespace {

constexpr std::uint32_t kWorkgroup = 64;

}  // namespace

MassStage::MassStage(const vulkan::Device& device, std::uint32_t nodes,
                     const std::array<const vulkan::Buffer*, kStates>& positions)
    : nodes_(nodes),
      upload_(device, vulkan::BufferPurpose::upload, nodes * sizeof(float)),
      kernel_(device, kernels::set_masses, kWorkgroup),
      bindings_{vulkan::Bindings(device, kernel_, {&upload_, positions[0]}),
                vulkan::Bindings(device, kernel_, {&upload_, positions[1]}),
                vulkan::Bindings(device, kernel_, {&upload_, positions[2]})} {}

void MassStage::set(std::span<const float> inverseMasses) {
  assert(inverseMasses.size() == nodes_);
  std::ranges::copy(inverseMasses, upload_.mapped<float>().begin());
}

void MassStage::record(vulkan::Recorder& recorder) const {
  for (const vulkan::Bindings& bindings : bindings_) recorder.dispatch(bindings, nodes_);
}

}  // namespace clothstream::simulation
