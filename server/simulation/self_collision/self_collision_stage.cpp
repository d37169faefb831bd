// SPDX-License-Identifier: MIT
// Self-collision on the device.
#include "server/simulation/self_collision/self_collision_stage.h"

#include <algorithm>
#include <cassert>
#include <vector>

#include "server/simulation/scene_tables.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::BufferPurpose;

constexpr std::uint32_t kListsATick = 3;
// Factor of the time until the next search, because velocities change in it.
constexpr float kAhead = 1.25f;

// Substeps between two searches.
std::uint32_t searchInterval(std::uint32_t substeps) {
  return (substeps + kListsATick - 1) / kListsATick;
}

float reachOf(std::span<const model::Cloth> cloths) {
  float radius = 0;
  for (const model::Cloth& cloth : cloths)
    if (cloth.selfCollision) radius = std::max(radius, cloth.selfCollision->radius);
  return 2 * radius;
}

std::vector<shared::RestRecord> restRecords(const model::Scene& scene) {
  const NodeState state = restState(scene.cloths);
  std::vector<shared::RestRecord> rests;
  for (std::size_t cloth = 0; cloth < scene.cloths.size(); ++cloth) {
    const bool balls = scene.cloths[cloth].selfCollision.has_value();
    for (std::uint32_t i = 0; i < scene.cloths[cloth].nodeCount(); ++i)
      rests.push_back(
          {vectorOf(state.positions[rests.size()]), balls ? static_cast<float>(cloth + 1) : 0.0f});
  }
  return rests;
}

}  // namespace

bool SelfCollisionStage::isIn(const model::Scene& scene) {
  return std::ranges::any_of(scene.cloths, [](const auto& cloth) { return cloth.selfCollision.has_value(); });
}

SelfCollisionStage::SelfCollisionStage(const vulkan::Device& device, const model::Scene& scene,
                                       const StateBuffers& state, std::uint32_t workgroupSize)
    : reach_(reachOf(scene.cloths)),
      rests_(device, restRecords(scene)),
      report_(device, BufferPurpose::state, sizeof(shared::CrowdReport)),
      reportReadback_(device, BufferPurpose::readback, 2 * sizeof(shared::CrowdReport)),
      search_(device, scene.nodeCount(), rests_.texels(), state, report_, workgroupSize),
      contacts_(device, scene.nodeCount(),
                {.rests = rests_.texels(), .neighbours = search_.lists(), .report = report_}, state,
                workgroupSize) {
  assert(isIn(scene));
  contacts_.setCloths(scene.cloths);
}

void SelfCollisionStage::setCloths(std::span<const model::Cloth> cloths) {
  contacts_.setCloths(cloths);
  reach_ = reachOf(cloths);
}

void SelfCollisionStage::recordTables(vulkan::Recorder& recorder) {
  rests_.recordUpload(recorder);
  contacts_.recordTables(recorder);
}

void SelfCollisionStage::recordInputs(vulkan::Recorder& recorder, const Tick&) {
  recorder.fill(report_, 0, report_.bytes());
}

void SelfCollisionStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const std::uint32_t interval = searchInterval(substep.tick.substeps);
  if (substep.index % interval == 0) {
    const auto substepSeconds = static_cast<float>(substep.tick.substepSeconds);
    search_.record(recorder, 1 - substep.from, kAhead * substepSeconds * static_cast<float>(interval - 1),
                   reach_);
  }
  for (int i = 0; i < model::kContactIterations; ++i) contacts_.record(recorder, substep);
}

void SelfCollisionStage::recordReport(vulkan::Recorder& recorder, const Tick& tick) {
  recorder.copy(report_, reportReadback_, report_.bytes(), 0, tick.slot * report_.bytes());
}

const shared::CrowdReport& SelfCollisionStage::report(std::uint32_t slot) const {
  return reportReadback_.mapped<const shared::CrowdReport>()[slot];
}

}  // namespace clothstream::simulation
