// SPDX-License-Identifier: MIT
#include "server/simulation/collision/surface_stage.h"

#include <algorithm>
#include <cassert>
#include <cstring>
#include <optional>
#include <utility>

#include "kernels/collide_surfaces.h"
#include "server/model/price.h"
#include "server/simulation/collision/solid_tables.h"
#include "server/simulation/texel.h"
#include "shaders/collision/surface.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

constexpr std::size_t kSurfaceRecordBytes = model::kMaxSceneSurfaces * sizeof(shared::SurfaceRecord);

// Makes up for the rounding of a box that is turned, m: far above that of coordinates below 2 km.
constexpr float kBoxRounding = 1e-3f;

shared::SurfaceRecord recordOf(const PlacedSurface& placed, std::size_t first) {
  const model::Surface& surface = placed.table->surface;
  const model::Vec3 middle = (surface.low + surface.high) / 2, half = (surface.high - surface.low) / 2;
  const Eigen::Matrix3f turn = placed.pose.orientation.toRotationMatrix();
  const model::Vec3 centre = placed.pose.position + turn * middle;
  const model::Vec3 reach = turn.cwiseAbs() * half + model::Vec3::Constant(kBoxRounding);
  return {.low = vectorOf(centre - reach),
          .solid = static_cast<float>(first),
          .high = vectorOf(centre + reach),
          .twoSided = placed.twoSided ? 1.0f : 0.0f,
          .position = vectorOf(placed.pose.position),
          .friction = placed.friction,
          .orientation = texel(placed.pose.orientation)};
}

}  // namespace

SurfaceStage::SurfaceStage(const vulkan::Device& device, std::span<const std::uint32_t> clothOffsets,
                           const StateBuffers& state, std::uint32_t workgroupSize)
    : device_(device),
      workgroupSize_(workgroupSize),
      tileCount_(static_cast<std::uint32_t>(nodeTiles(clothOffsets, workgroupSize).size())),
      texels_(device, BufferPurpose::texels, mostSurfaceTexels() * kTexelBytes),
      surfaces_(device, BufferPurpose::texels, kSurfaceRecordBytes),
      tiles_(device, nodeTiles(clothOffsets, workgroupSize)),
      collide_(bindStates(device, {device, kernels::collide_surfaces, workgroupSize},
                          [&](std::size_t from) {
                            const std::size_t to = 1 - from;
                            return BufferList{
                                &state.cloths,          &tiles_.texels(),    &texels_,
                                state.positions[from],  state.positions[to], state.velocities[to],
                                &state.contactImpulses, &surfaces_};
                          })),
      free_(mostSurfaceTexels()) {
  for (std::size_t slot = 0; slot < uploads_.size(); ++slot) {
    uploads_[slot] = Buffer(device, BufferPurpose::upload, kSurfaceUploadTexels * kTexelBytes);
    surfaceUploads_[slot] = Buffer(device, BufferPurpose::upload, kSurfaceRecordBytes);
  }
}

void SurfaceStage::recordTables(vulkan::Recorder& recorder) {
  tiles_.recordUpload(recorder);
}

const SurfaceStage::Resident* SurfaceStage::find(const SurfaceTable& table) const {
  const auto found =
      std::ranges::find(residents_, &table, [](const Resident& resident) { return resident.table.get(); });
  return found == residents_.end() ? nullptr : &*found;
}

std::size_t SurfaceStage::texelsToUpload(const SurfaceTable& table) const {
  const Resident* const resident = find(table);
  return surfaceTexels(table) - (resident == nullptr ? 0 : resident->uploaded);
}

void SurfaceStage::forgetOthers(const TickInputs& inputs) {
  std::erase_if(residents_, [&](const Resident& resident) {
    const auto isOf = [&](const PlacedSurface& placed) { return placed.table == resident.table; };
    if (std::ranges::any_of(inputs.surfaces, isOf) ||
        std::ranges::find(inputs.arriving, resident.table) != inputs.arriving.end())
      return false;
    free_.giveBack(resident.first, surfaceTexels(*resident.table));
    return true;
  });
}

std::optional<std::size_t> SurfaceStage::place(const SharedSurface& table) {
  if (const Resident* const resident = find(*table))
    return static_cast<std::size_t>(resident - residents_.data());
  const std::optional<std::uint64_t> first = free_.take(surfaceTexels(*table), 1);
  if (!first) return std::nullopt;
  residents_.push_back({.table = table, .first = static_cast<std::size_t>(*first), .uploaded = 0});
  return residents_.size() - 1;
}

void SurfaceStage::placeActing(const TickInputs& inputs) {
  const auto placeAll = [&] {
    return std::ranges::all_of(inputs.surfaces,
                               [&](const PlacedSurface& placed) { return place(placed.table).has_value(); });
  };
  if (placeAll()) return;
  for (const Resident& resident : residents_) free_.giveBack(resident.first, surfaceTexels(*resident.table));
  residents_.clear();
  const bool placed = placeAll();
  assert(placed);  // a scene has no more than mostSurfaceTexels() has room for
  static_cast<void>(placed);
}

void SurfaceStage::plan(std::size_t resident, std::size_t most) {
  Resident& to = residents_[resident];
  const std::size_t count = std::min(most, surfaceTexels(*to.table) - to.uploaded);
  if (count == 0) return;
  parts_.push_back({.resident = resident, .first = to.uploaded, .count = count});
  to.uploaded += count;
}

void SurfaceStage::recordInputs(vulkan::Recorder& recorder, const Tick& tick) {
  const TickInputs& inputs = tick.inputs;
  assert(inputs.surfaces.size() <= model::kMaxSceneSurfaces);
  parts_.clear();
  forgetOthers(inputs);
  placeActing(inputs);
  for (const PlacedSurface& placed : inputs.surfaces)
    plan(*place(placed.table), surfaceTexels(*placed.table));
  std::size_t used = 0;
  for (const Part& part : parts_) used += part.count;
  for (const SharedSurface& table : inputs.arriving) {
    if (used >= kSurfaceUploadTexels) break;
    // Without a place it waits, and is uploaded when it acts.
    if (const std::optional<std::size_t> resident = place(table)) {
      const std::size_t before = residents_[*resident].uploaded;
      plan(*resident, kSurfaceUploadTexels - used);
      used += residents_[*resident].uploaded - before;
    }
  }
  recordParts(recorder, tick.slot);
  recordSurfaces(recorder, tick);
}

void SurfaceStage::recordParts(vulkan::Recorder& recorder, std::uint32_t slot) {
  std::size_t all = 0;
  for (const Part& part : parts_) all += part.count;
  if (all == 0) return;
  Buffer& through = uploads_[slot];
  if (through.bytes() < all * kTexelBytes)
    through = Buffer(device_, BufferPurpose::upload, all * kTexelBytes);
  std::size_t offset = 0;
  for (const Part& part : parts_) {
    const Resident& resident = residents_[part.resident];
    const std::vector<shared::vec4> header = surfaceHeader(*resident.table, resident.first);
    const auto to = through.mapped<shared::vec4>().subspan(offset, part.count);
    const std::size_t ofHeader = std::min(header.size() - std::min(header.size(), part.first), part.count);
    std::copy_n(header.begin() + static_cast<std::ptrdiff_t>(std::min(header.size(), part.first)), ofHeader,
                to.begin());
    const std::size_t begin = std::max(part.first, header.size()) - header.size();
    std::copy_n(resident.table->texels.begin() + static_cast<std::ptrdiff_t>(begin), part.count - ofHeader,
                to.begin() + static_cast<std::ptrdiff_t>(ofHeader));
    recorder.copy(through, texels_, part.count * kTexelBytes, offset * kTexelBytes,
                  (resident.first + part.first) * kTexelBytes);
    offset += part.count;
  }
}

void SurfaceStage::recordSurfaces(vulkan::Recorder& recorder, const Tick& tick) {
  count_ = static_cast<std::uint32_t>(tick.inputs.surfaces.size());
  if (count_ == 0) return;
  const Buffer& through = surfaceUploads_[tick.slot];
  const auto records = through.mapped<shared::SurfaceRecord>();
  double work = 1;
  for (std::size_t i = 0; i < count_; ++i) {
    const PlacedSurface& placed = tick.inputs.surfaces[i];
    records[i] = recordOf(placed, find(*placed.table)->first);
    work += model::surfaceWork(placed.table->surface);
  }
  work_ = static_cast<std::uint64_t>(work);
  recorder.copy(through, surfaces_, count_ * sizeof(shared::SurfaceRecord));
}

void SurfaceStage::recordSubstep(vulkan::Recorder& recorder, const Substep& substep) {
  if (count_ == 0) return;
  shared::CollisionPush collision = substep.collision;
  collision.contactClothCount = 0;  // surfaces report no contacts
  recorder.barrier();
  recorder.dispatch(collide_[substep.from],
                    shared::SurfacePush{
                        .collision = collision,
                        .surfaceCount = count_,
                        .rounds = model::kSurfaceRounds,
                        .leastDistance = model::kLeastSurfaceDistance,
                        .depth = model::kSurfaceDepth,
                        .pushed = model::kSurfacePushSpeed * static_cast<float>(substep.tick.substepSeconds),
                        .reserved0 = 0,
                        .reserved1 = 0,
                        .reserved2 = 0},
                    std::uint64_t{tileCount_} * workgroupSize_, work_, work_ + shared::kMostSurfaceVisits);
}

}  // namespace clothstream::simulation
