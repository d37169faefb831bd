// SPDX-License-Identifier: MIT
// Self-collision on the device.
#include "server/simulation/self_collision/self_collision_stage.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <limits>

#include "kernels/count_cells.h"
#include "kernels/count_contacts.h"
#include "kernels/fill_cells.h"
#include "kernels/gather_neighbours.h"
#include "kernels/measure_velocities.h"
#include "kernels/resolve_contacts.h"
#include "kernels/sort_cells.h"
#include "kernels/start_cells.h"
#include "server/simulation/scene_tables.h"
#include "server/simulation/texel.h"

namespace clothstream::simulation {
namespace {

using vulkan::Bindings;
using vulkan::BufferPurpose;

constexpr std::uint32_t kListsATick = 3;
// Work of a node (vulkan::Recorder::dispatch) when its neighbours are listed, and in a contact iteration.
constexpr std::uint32_t kGatherWork = 8, kContactWork = 4;
// The most of the former: a search passes over kMaxInRow balls in each of nine rows, twice.
constexpr std::uint32_t kMostGatherWork = 2 * 9 * shared::kMaxInRow / 8;
// The most work of a ball when its cell is sorted.
constexpr std::uint32_t kMostSortWork = shared::kMaxInRow / 8;
// Factor of the time until the next search, because velocities change in it.
constexpr float kAhead = 1.25f;

// Substeps between two searches.
std::uint32_t searchInterval(std::uint32_t substeps) {
  return (substeps + kListsATick - 1) / kListsATick;
}

// There are twice as many entries as nodes, so that cells that are not neighbours seldom share an entry.
std::uint32_t cellCountOf(std::uint32_t nodes) {
  return std::max(shared::kCellBlock, std::bit_ceil(2 * nodes));
}

std::size_t tableBytes(std::uint32_t cells) {
  return (std::size_t{cells} + cells / shared::kCellBlock + shared::kTableWords) * sizeof(std::uint32_t);
}

float reachOf(std::span<const model::Cloth> cloths) {
  float radius = 0;
  for (const model::Cloth& cloth : cloths)
    if (cloth.selfCollision) radius = std::max(radius, cloth.selfCollision->radius);
  return 2 * radius;
}

bool hasSeveralMaterials(std::span<const model::Cloth> cloths) {
  const model::SelfCollision* first = nullptr;
  for (const model::Cloth& cloth : cloths) {
    if (!cloth.selfCollision) continue;
    if (first == nullptr) first = &*cloth.selfCollision;
    if (first->radius != cloth.selfCollision->radius || first->friction != cloth.selfCollision->friction)
      return true;
  }
  return false;
}

void fillRests(const model::Scene& scene, std::span<shared::RestRecord> rests) {
  const NodeState state = restState(scene.cloths);
  std::size_t node = 0;
  for (std::size_t cloth = 0; cloth < scene.cloths.size(); ++cloth)
    for (std::uint32_t i = 0; i < scene.cloths[cloth].nodeCount(); ++i, ++node) {
      const bool balls = scene.cloths[cloth].selfCollision.has_value();
      rests[node] = {vectorOf(state.positions[node]), balls ? static_cast<float>(cloth + 1) : 0.0f};
    }
}

}  // namespace

bool SelfCollisionStage::isIn(const model::Scene& scene) {
  return std::ranges::any_of(scene.cloths, [](const auto& cloth) { return cloth.selfCollision.has_value(); });
}

SelfCollisionStage::SelfCollisionStage(const vulkan::Device& device, const model::Scene& scene,
                                       const StateBuffers& state, std::uint32_t workgroupSize)
    : device_(device),
      state_(state),
      workgroupSize_(workgroupSize),
      nodeCount_(scene.nodeCount()),
      cellCount_(cellCountOf(nodeCount_)),
      measureInvocations_((nodeCount_ + 63) / 64),
      reach_(reachOf(scene.cloths)),
      restsUpload_(device, BufferPurpose::upload, nodeCount_ * kTexelBytes),
      rests_(device, BufferPurpose::texels, nodeCount_ * kTexelBytes),
      table_(device, BufferPurpose::state, tableBytes(cellCount_)),
      starts_(device, BufferPurpose::state, (cellCount_ + 1) * sizeof(std::uint32_t)),
      entries_(device, BufferPurpose::state, nodeCount_ * sizeof(std::uint32_t)),
      order_(device, BufferPurpose::state, nodeCount_ * sizeof(std::uint32_t)),
      sorted_(device, BufferPurpose::texels, nodeCount_ * kTexelBytes),
      neighbours_(device, BufferPurpose::texels,
                  std::size_t{nodeCount_} * shared::kNeighbourStride * sizeof(float)),
      contactPositions_(device, BufferPurpose::texels, nodeCount_ * kTexelBytes),
      contactVelocities_(device, BufferPurpose::texels, nodeCount_ * kTexelBytes),
      contacts_(device, BufferPurpose::texels,
                std::size_t{nodeCount_} * shared::kMaxContacts * sizeof(float)),
      touching_(device, BufferPurpose::state, nodeCount_ * sizeof(std::uint32_t)),
      groups_(device, BufferPurpose::indirect, sizeof(shared::ContactGroups)),
      report_(device, BufferPurpose::state, sizeof(shared::CrowdReport)),
      reportReadback_(device, BufferPurpose::readback, 2 * sizeof(shared::CrowdReport)),
      measure_(bindStates(device, {device, kernels::measure_velocities, workgroupSize},
                          [&](std::size_t of) {
                            return BufferList{&rests_, state.velocities[of], &table_};
                          })),
      countCells_(bindStates(device, {device, kernels::count_cells, workgroupSize},
                             [&](std::size_t of) {
                               return BufferList{&rests_, state.positions[of], &table_, &entries_};
                             })),
      startCells_(bindStates(device, {device, kernels::start_cells, workgroupSize},
                             [&](std::size_t) {
                               return BufferList{&table_, &starts_};
                             })),
      fillCells_(bindStates(device, {device, kernels::fill_cells, workgroupSize},
                            [&](std::size_t) {
                              return BufferList{&rests_, &entries_, &table_, &order_};
                            })),
      sortCells_(bindStates(device, {device, kernels::sort_cells, workgroupSize},
                            [&](std::size_t of) {
                              return BufferList{state.positions[of], &entries_, &starts_, &order_, &sorted_};
                            })),
      gather_(bindStates(device, {device, kernels::gather_neighbours, workgroupSize}, [&](std::size_t of) {
        return BufferList{&state.cloths, &rests_,  &sorted_,     state.velocities[of],
                          &table_,       &starts_, &neighbours_, &report_};
      })) {
  assert(isIn(scene));
  fillRests(scene, restsUpload_.mapped<shared::RestRecord>());
  makeContacts(scene.cloths);
}

SelfCollisionStage::Contacts::Contacts(const vulkan::Device& device, const StateBuffers& state,
                                       const SelfCollisionStage& stage, bool several)
    : count(bindStates(device, {device, kernels::count_contacts, stage.workgroupSize_, {several ? 1u : 0u}},
                       [&](std::size_t of) {
                         return BufferList{&state.cloths,
                                           &stage.rests_,
                                           &stage.neighbours_,
                                           state.positions[of],
                                           state.velocities[of],
                                           &stage.contactPositions_,
                                           &stage.contactVelocities_,
                                           &stage.contacts_,
                                           &stage.touching_,
                                           &stage.groups_,
                                           &stage.report_};
                       })),
      resolve(bindStates(device,
                         {device, kernels::resolve_contacts, stage.workgroupSize_, {several ? 1u : 0u}},
                         [&](std::size_t of) {
                           return BufferList{&state.cloths,
                                             &stage.rests_,
                                             &state.colliders,
                                             &state.nearColliders,
                                             &stage.contacts_,
                                             &stage.contactPositions_,
                                             &stage.contactVelocities_,
                                             state.positions[1 - of],
                                             &stage.touching_,
                                             &stage.groups_,
                                             state.positions[of],
                                             state.velocities[of],
                                             &state.contactImpulses};
                         })) {}

void SelfCollisionStage::makeContacts(std::span<const model::Cloth> cloths) {
  const bool several = hasSeveralMaterials(cloths);
  std::unique_ptr<Contacts>& kernels = contactKernels_[several ? 1 : 0];
  if (!kernels) kernels = std::make_unique<Contacts>(device_, state_, *this, several);
  several_ = several ? 1 : 0;
}

void SelfCollisionStage::setCloths(std::span<const model::Cloth> cloths) {
  makeContacts(cloths);
  reach_ = reachOf(cloths);
}

void SelfCollisionStage::recordTables(vulkan::Recorder& recorder) {
  recorder.copy(restsUpload_, rests_, rests_.bytes());
  recorder.fill(groups_, 1, groups_.bytes());
}

void SelfCollisionStage::recordInputs(vulkan::Recorder& recorder, const Tick&) {
  recorder.fill(report_, 0, report_.bytes());
}

void SelfCollisionStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  const std::uint32_t interval = searchInterval(substep.tick.substeps);
  if (substep.index % interval == 0) recordNeighbours(recorder, substep, interval);
  for (int i = 0; i < model::kContactIterations; ++i) recordContacts(recorder, substep);
}

void SelfCollisionStage::recordNeighbours(vulkan::Recorder& recorder, const Substep& substep,
                                          std::uint32_t interval) const {
  const std::uint32_t state = 1 - substep.from;
  const auto substepSeconds = static_cast<float>(substep.tick.substepSeconds);
  const shared::NeighbourPush push{.nodeCount = nodeCount_,
                                   .cellCount = cellCount_,
                                   .aheadSeconds = kAhead * substepSeconds * static_cast<float>(interval - 1),
                                   .reach = reach_,
                                   .restFactor = model::kNeighbours};
  const auto dispatch = [&](const StateBindings& kernel, std::uint64_t invocations) {
    recorder.barrier();
    recorder.dispatch(kernel[state], push, invocations);
  };
  recorder.barrier();
  recorder.fill(table_, 0, table_.bytes());
  dispatch(measure_, measureInvocations_);
  dispatch(countCells_, nodeCount_);
  dispatch(startCells_, cellCount_ / shared::kCellBlock);
  dispatch(fillCells_, nodeCount_);
  recorder.barrier();
  recorder.dispatch(sortCells_[state], push, nodeCount_, 1, kMostSortWork);
  recorder.barrier();
  recorder.dispatch(gather_[state], push, nodeCount_, kGatherWork, kMostGatherWork);
}

void SelfCollisionStage::recordContacts(vulkan::Recorder& recorder, const Substep& substep) const {
  const std::uint32_t state = 1 - substep.from;
  const auto substepSeconds = static_cast<float>(substep.tick.substepSeconds);
  const shared::ContactPush push{.collision = substep.collision,
                                 .nodeCount = nodeCount_,
                                 .substepSeconds = substepSeconds,
                                 .correctionRate = model::kOverlapCorrectionFraction / substepSeconds,
                                 .pushOutSpeed = model::kPushOutSpeed};
  recorder.barrier();
  recorder.fill(groups_, 0, sizeof(std::uint32_t), offsetof(shared::ContactGroups, x));
  recorder.fill(groups_, 0, sizeof(std::uint32_t), offsetof(shared::ContactGroups, touching));
  recorder.barrier();
  recorder.dispatch(contactKernels_[several_]->count[state], push, nodeCount_, kContactWork);
  recorder.barrier();
  const Bindings& resolve = contactKernels_[several_]->resolve[state];
  const std::uint64_t work = std::uint64_t{kContactWork} * substep.collision.nodeWork;
  // Indirect dispatches cannot be divided.
  if (recorder.divides(resolve, nodeCount_, work))
    recorder.dispatch(resolve, push, nodeCount_, work);
  else
    recorder.dispatchIndirect(resolve, push, groups_, 0, nodeCount_ * work);
}

void SelfCollisionStage::recordReport(vulkan::Recorder& recorder, const Tick& tick) {
  recorder.copy(report_, reportReadback_, report_.bytes(), 0, tick.slot * report_.bytes());
}

const shared::CrowdReport& SelfCollisionStage::report(std::uint32_t slot) const {
  return reportReadback_.mapped<const shared::CrowdReport>()[slot];
}

}  // namespace clothstream::simulation
