// SPDX-License-Identifier: MIT
// Upload of colliders, and the kernel that finds those near a tile.
#include "server/simulation/collision/collision_stage.h"

#include <algorithm>
#include <cstring>
#include <tuple>
#include <vector>

#include "kernels/gather_near_colliders.h"
#include "server/model/price.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::size_t kColliderBytes =
    kMaxColliders * sizeof(shared::ColliderRecord) + kMaxColliderPlanes * sizeof(shared::vec4);
constexpr std::size_t kBoundsBytes =
    (kMaxColliders + kMaxColliders / shared::kColliderGroup) * sizeof(shared::ColliderBounds);

// The lists are no larger than the positions, so that they limit no cloth's size (Limits::maxStorageRange).
static_assert(shared::kNearStride * sizeof(float) <= shared::kNearNodes * sizeof(shared::vec4));

constexpr std::uint32_t kGatherWorkgroup = 32;

constexpr std::size_t listsOf(std::uint32_t nodes) {
  return (std::size_t{nodes} + shared::kNearNodes - 1) / shared::kNearNodes;
}

// Copies to the upload buffer, and from there to the device.
template <typename Record>
std::size_t upload(vulkan::Recorder& recorder, const std::vector<Record>& records, const Buffer& through,
                   std::size_t offset, const Buffer& to, std::size_t toOffset) {
  const std::size_t bytes = records.size() * sizeof(Record);
  if (bytes == 0) return offset;
  std::memcpy(through.mapped().data() + offset, records.data(), bytes);
  recorder.copy(through, to, bytes, offset, toOffset);
  return offset + bytes;
}

}  // namespace

CollisionStage::CollisionStage(const vulkan::Device& device, const SolidTables& solids,
                               std::uint32_t nodeCount, std::uint32_t clothCount,
                               std::array<const Buffer*, 2> positions,
                               std::array<const Buffer*, 2> velocities)
    : solidTables_(solids),
      nodeCount_(nodeCount),
      clothCount_(clothCount),
      colliders_(device, BufferPurpose::texels, kColliderBytes),
      bounds_(device, BufferPurpose::texels, kBoundsBytes),
      nearLists_(device, BufferPurpose::texels, listsOf(nodeCount) * shared::kNearStride * sizeof(float)),
      contactImpulses_(device, BufferPurpose::state, kMaxColliders * clothCount * sizeof(std::uint32_t)),
      uploads_{Buffer(device, BufferPurpose::upload, kColliderBytes + kBoundsBytes),
               Buffer(device, BufferPurpose::upload, kColliderBytes + kBoundsBytes)},
      device_(device),
      gather_(bindStates(device, {device, kernels::gather_near_colliders, kGatherWorkgroup},
                         [&](std::size_t from) {
                           return BufferList{positions[from], velocities[from], &bounds_, &nearLists_};
                         })) {}

void CollisionStage::recordInputs(vulkan::Recorder& recorder, const Tick& tick) {
  const std::vector<MovingCollider>& colliders = tick.inputs.colliders;
  ordered_.clear();
  indices_.clear();
  double work = 1;
  for (const bool solids : {false, true}) {
    for (std::uint32_t i = 0; i < colliders.size(); ++i) {
      if (isSolid(colliders[i]) != solids) continue;
      ordered_.push_back(&colliders[i]);
      indices_.push_back(i);
      if (!solids) work += model::colliderWork(colliders[i].shape);
    }
    if (!solids) count_ = static_cast<std::uint32_t>(ordered_.size());
  }
  fill(tables_, ordered_, solidTables_);
  nodeWork_ = static_cast<std::uint32_t>(work);
  const Buffer& through = uploads_[tick.slot];
  std::size_t offset = upload(recorder, tables_.records, through, 0, colliders_, 0);
  offset = upload(recorder, tables_.planes, through, offset, colliders_, offset);
  upload(recorder, tables_.bounds, through, offset, bounds_, 0);
  reportsContacts_ = tick.inputs.reportsContacts && !colliders.empty();
  if (reportsContacts_) recorder.fill(contactImpulses_, 0, contactBytes());
}

void CollisionStage::recordReport(vulkan::Recorder& recorder, const Tick& tick) {
  if (!reportsContacts_) return;
  Buffer& readback = contactReadbacks_[tick.slot];
  if (readback.bytes() == 0) readback = Buffer(device_, BufferPurpose::readback, contactImpulses_.bytes());
  recorder.copy(contactImpulses_, readback, contactBytes());
}

void CollisionStage::readContacts(std::uint32_t slot, std::vector<ContactStatus>& contacts) const {
  contacts.clear();
  if (!reportsContacts_) return;
  const auto units = contactReadbacks_[slot].mapped<const std::uint32_t>();
  for (std::uint32_t i = 0; i < indices_.size() * clothCount_; ++i)
    if (units[i] != 0)
      contacts.push_back(
          {indices_[i / clothCount_], i % clothCount_, units[i] / double{shared::kImpulseUnits}});
  std::ranges::sort(contacts, {},
                    [](const ContactStatus& status) { return std::tuple(status.collider, status.cloth); });
}

void CollisionStage::order(std::span<const float> numbers, std::vector<float>& values) const {
  values.resize(indices_.size());
  for (std::size_t i = 0; i < indices_.size(); ++i) values[indices_[i]] = numbers[i];
}

void CollisionStage::recordStart(vulkan::Recorder& recorder, const Tick& tick, std::uint32_t present) {
  if (count_ == 0) return;
  float thickness = 0;
  for (const shared::ClothRecord& cloth : tick.cloths) thickness = std::max(thickness, cloth.thickness);
  recorder.beginStage("near");
  recorder.barrier();
  recorder.dispatch(gather_[present], shared::GatherPush{nodeCount_, count_, 1 / tick.rate, thickness},
                    listsOf(nodeCount_), shared::kNearNodes + count_);
}

shared::CollisionPush CollisionStage::push(std::uint32_t substep, std::uint32_t substeps,
                                           float tickRate) const {
  return {.colliderCount = count_,
          .progressBefore = static_cast<float>(substep) / static_cast<float>(substeps),
          .progressAfter = static_cast<float>(substep + 1) / static_cast<float>(substeps),
          .tickRate = tickRate,
          .substepRate = tickRate * static_cast<float>(substeps),
          .contactClothCount = reportsContacts_ ? clothCount_ : 0,
          .nodeWork = nodeWork_,
          .substepSeconds = 1 / (tickRate * static_cast<float>(substeps))};
}

}  // namespace clothstream::simulation
