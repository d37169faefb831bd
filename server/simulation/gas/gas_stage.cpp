// SPDX-License-Identifier: MIT
// Gas inside closed cloths on the device.
#include "server/simulation/gas/gas_stage.h"

#include <algorithm>
#include <utility>

#include "kernels/measure_shares.h"
#include "kernels/push_nodes.h"
#include "kernels/solve_pressure.h"
#include "server/model/gas.h"
#include "server/model/mesh.h"
#include "server/simulation/mesh_tables.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/workgroup_work.h"

namespace clothstream::simulation {
namespace {

// Work of a node (vulkan::Recorder::dispatch), which gathers from its triangles.
constexpr std::uint32_t kMeasureWork = 2;
// Invocations that add up a cloth. A software device runs eight at a time, and barriers between more cost
// most of its time.
constexpr std::uint32_t kGpuSolveLanes = CLOTHSTREAM_SOLVE_LANES, kCpuSolveLanes = 8;

bool mayHaveGas(const model::Scene& scene, const model::Cloth& cloth) {
  return scene.integrator == model::Integrator::semiImplicitEuler && model::canHoldGas(cloth);
}

}  // namespace

struct GasStage::Tables {
  std::vector<Enclosure> enclosures;
  std::vector<shared::MeshNodeRecord> nodes;
  std::vector<shared::CornerPairRecord> corners;

  explicit Tables(const model::Scene& scene) {
    std::uint32_t firstNode = 0;
    for (std::uint32_t i = 0; i < scene.cloths.size(); firstNode += scene.cloths[i++].nodeCount()) {
      const model::Cloth& cloth = scene.cloths[i];
      if (!mayHaveGas(scene, cloth)) continue;
      const std::size_t before = nodes.size();
      nodes.resize(before + cloth.nodeCount());
      appendCorners(*cloth.mesh, firstNode, std::span(nodes).subspan(before), corners);
      enclosures.push_back({.cloth = i,
                            .firstNode = firstNode,
                            .nodeCount = cloth.nodeCount(),
                            .firstRecord = static_cast<std::uint32_t>(before),
                            .volume = cloth.mesh->volume});
    }
  }
};

GasStage::GasStage(const vulkan::Device& device, const model::Scene& scene, const StateBuffers& state,
                   const vulkan::Buffer& gas, std::uint32_t workgroupSize)
    : GasStage(device, Tables(scene), scene, state, gas, workgroupSize) {}

GasStage::GasStage(const vulkan::Device& device, const Tables& tables, const model::Scene& scene,
                   const StateBuffers& state, const vulkan::Buffer& gas, std::uint32_t workgroupSize)
    : enclosures_(tables.enclosures),
      nodes_(device, tables.nodes),
      corners_(device, tables.corners),
      gas_(gas),
      shares_(device, vulkan::BufferPurpose::texels,
              tables.nodes.size() * CLOTHSTREAM_GAS_SHARE_TEXELS * sizeof(shared::vec4)),
      measure_(bindStates(device, {device, kernels::measure_shares, workgroupSize},
                          [&](std::size_t from) {
                            return BufferList{&nodes_.texels(), &corners_.texels(), state.positions[from],
                                              state.positions[1 - from], &shares_};
                          })),
      solve_(device,
             {device, kernels::solve_pressure, device.hasGpuKernels() ? kGpuSolveLanes : kCpuSolveLanes},
             {&shares_, &gas}),
      push_{bindPush(device, state, workgroupSize, false), bindPush(device, state, workgroupSize, true)} {
  setCloths(scene.cloths);
}

StateBindings GasStage::bindPush(const vulkan::Device& device, const StateBuffers& state,
                                 std::uint32_t workgroupSize, bool collides) const {
  return bindStates(device, {device, kernels::push_nodes, workgroupSize, {collides ? 1u : 0u}},
                    [&](std::size_t from) {
                      return BufferList{&state.cloths,
                                        &shares_,
                                        &gas_,
                                        &state.colliders,
                                        &state.nearColliders,
                                        state.positions[from],
                                        state.positions[1 - from],
                                        state.velocities[1 - from],
                                        &state.contactImpulses};
                    });
}

bool GasStage::isIn(const model::Scene& scene) {
  return std::ranges::any_of(scene.cloths,
                             [&](const model::Cloth& cloth) { return mayHaveGas(scene, cloth); });
}

void GasStage::setCloths(std::span<const model::Cloth> cloths) {
  for (Enclosure& enclosure : enclosures_) {
    const model::Cloth& cloth = cloths[enclosure.cloth];
    enclosure.pressure = cloth.pressure;
    enclosure.collides = followOf(cloth) == Follow::gas;
  }
}

void GasStage::recordTables(vulkan::Recorder& recorder) {
  nodes_.recordUpload(recorder);
  corners_.recordUpload(recorder);
}

// A cloth without gas has no past either.
void GasStage::recordInputs(vulkan::Recorder& recorder, const Tick&) {
  for (const Enclosure& enclosure : enclosures_)
    if (enclosure.pressure == 0)
      recorder.fill(gas_, 0, sizeof(shared::vec4), enclosure.cloth * sizeof(shared::vec4));
}

shared::GasPush GasStage::pushOf(const Enclosure& enclosure, const Substep& substep) const {
  const double h = substep.tick.substepSeconds;
  return {.collision = substep.collision,
          .cloth = enclosure.cloth,
          .firstNode = enclosure.firstNode,
          .nodeCount = enclosure.nodeCount,
          .firstRecord = enclosure.firstRecord,
          .atRest = static_cast<float>(enclosure.pressure / model::kOutsidePressure),
          .perVolume = static_cast<float>(1 / enclosure.volume),
          .response = static_cast<float>(h * h * model::kOutsidePressure / enclosure.volume),
          .squaredSubstep = static_cast<float>(h * h),
          .impulse = static_cast<float>(h * model::kOutsidePressure),
          .substepSeconds = static_cast<float>(h),
          .reserved0 = 0,
          .reserved1 = 0};
}

void GasStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  if (std::ranges::all_of(enclosures_, [](const Enclosure& each) { return each.pressure == 0; })) return;
  const auto forEach = [&](const auto& record) {
    recorder.barrier();
    for (const Enclosure& enclosure : enclosures_)
      if (enclosure.pressure != 0) record(enclosure, pushOf(enclosure, substep));
  };
  forEach([&](const Enclosure& each, const shared::GasPush& push) {
    recorder.dispatch(measure_[substep.from], push, each.nodeCount, kMeasureWork);
  });
  const std::uint32_t lanes = solve_.kernel().workgroupSize();
  forEach([&](const Enclosure& each, const shared::GasPush& push) {
    recorder.dispatch(solve_, push, lanes, workPerInvocation(each.nodeCount, lanes));
  });
  forEach([&](const Enclosure& each, const shared::GasPush& push) {
    const bool collides = each.collides && push.collision.colliderCount > 0;
    recorder.dispatch(push_[collides ? 1 : 0][substep.from], push, each.nodeCount,
                      collides ? 1 + push.collision.nodeWork : 1);
  });
}

}  // namespace clothstream::simulation
