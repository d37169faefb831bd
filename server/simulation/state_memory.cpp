// SPDX-License-Identifier: MIT
// The state of a scene on the device.
#include "server/simulation/state_memory.h"

#include <cassert>

#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

}  // namespace

StateMemory::StateMemory(const vulkan::Device& device, std::uint32_t nodes, std::uint32_t gasCloths)
    : checkpointPositions(device, BufferPurpose::state, nodes * sizeof(shared::vec4)),
      checkpointVelocities(device, BufferPurpose::state, bytes()),
      device_(device),
      nodes_(nodes),
      gasCloths_(gasCloths) {
  if (gasCloths > 0) {
    gas = Buffer(device, BufferPurpose::texels, gasCloths * sizeof(shared::vec4));
    checkpointGas = Buffer(device, BufferPurpose::state, gas.bytes());
  }
  upload_ = Buffer(device, BufferPurpose::upload, allBytes());
  for (Buffer& buffer : positions) buffer = Buffer(device, BufferPurpose::texels, bytes());
  for (Buffer& buffer : velocities) buffer = Buffer(device, BufferPurpose::texels, bytes());
}

void StateMemory::write(const NodeState& state, std::span<const float> inverseMasses) {
  const std::span<shared::vec4> texels = upload_.mapped<shared::vec4>();
  for (std::uint32_t i = 0; i < nodes_; ++i) {
    texels[i] = texel(state.positions[i], inverseMasses[i]);
    texels[nodes_ + i] = texel(state.velocities[i], 0);
  }
  for (std::uint32_t i = 0; i < gasCloths_; ++i) {
    const GasState gasState = i < state.gas.size() ? state.gas[i] : GasState{};
    texels[2 * nodes_ + i] = {gasState.volume, gasState.squaredSubstep, 0, 0};
  }
}

void StateMemory::recordUpload(vulkan::Recorder& recorder, std::uint32_t present) const {
  recorder.copy(upload_, positions[present], bytes());
  recorder.copy(upload_, velocities[present], bytes(), bytes());
  recorder.copy(upload_, checkpointPositions, bytes());
  recorder.copy(upload_, checkpointVelocities, bytes(), bytes());
  if (gasCloths_ == 0) return;
  recorder.copy(upload_, gas, gasBytes(), 2 * bytes());
  recorder.copy(upload_, checkpointGas, gasBytes(), 2 * bytes());
}

void StateMemory::recordCheckpoint(vulkan::Recorder& recorder, std::uint32_t present) const {
  recorder.copy(positions[present], checkpointPositions, bytes());
  recorder.copy(velocities[present], checkpointVelocities, bytes());
  if (gasCloths_ > 0) recorder.copy(gas, checkpointGas, gasBytes());
}

void StateMemory::recordRollback(vulkan::Recorder& recorder, std::uint32_t present) const {
  recorder.copy(checkpointPositions, positions[present], bytes());
  recorder.copy(checkpointVelocities, velocities[present], bytes());
  if (gasCloths_ > 0) recorder.copy(checkpointGas, gas, gasBytes());
}

void StateMemory::recordSave(vulkan::Recorder& recorder, std::uint32_t present) {
  if (readback_.bytes() == 0) readback_ = Buffer(device_, BufferPurpose::readback, allBytes());
  recorder.copy(positions[present], readback_, bytes());
  recorder.copy(velocities[present], readback_, bytes(), 0, bytes());
  if (gasCloths_ > 0) recorder.copy(gas, readback_, gasBytes(), 0, 2 * bytes());
}

NodeState StateMemory::collect() const {
  const std::span<const shared::vec4> texels = readback_.mapped<const shared::vec4>();
  assert(!texels.empty());
  NodeState state;
  for (const shared::vec4& p : texels.first(nodes_)) state.positions.emplace_back(p.x, p.y, p.z);
  for (const shared::vec4& v : texels.subspan(nodes_, nodes_)) state.velocities.emplace_back(v.x, v.y, v.z);
  bool any = false;
  for (const shared::vec4& g : texels.subspan(2 * std::size_t{nodes_})) {
    state.gas.push_back({g.x, g.y});
    any = any || g.y != 0;
  }
  if (!any) state.gas.clear();
  return state;
}

}  // namespace clothstream::simulation
