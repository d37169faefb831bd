// SPDX-License-Identifier: MIT
// Kernels of the report, and the evaluation of their counts.
#include "server/simulation/report_stage.h"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "kernels/add_up_cloths.h"
#include "kernels/measure_cloths.h"
#include "kernels/measure_penetrations.h"
#include "kernels/measure_solids.h"

namespace clothstream::simulation {
namespace {

using vulkan::Buffer;
using vulkan::BufferPurpose;

// Work of a node and a mesh, with a search that is not bounded (vulkan::Recorder::dispatch).
constexpr std::uint64_t kSolidDepthWork = 100;

ReportBlocks blocksOf(std::span<const shared::ClothRecord> cloths) {
  ReportBlocks blocks;
  std::uint32_t inMeshes = 0;
  for (std::size_t cloth = 0; cloth < cloths.size(); ++cloth) {
    const auto rows = static_cast<std::uint32_t>(cloths[cloth].rows);
    const auto columns = static_cast<std::uint32_t>(cloths[cloth].columns);
    const bool isMesh = rows == 0;
    const std::uint32_t nodes = isMesh ? columns : rows * columns;
    const std::uint32_t count = (nodes + shared::kReportBlock - 1) / shared::kReportBlock;
    shared::ReportClothRecord& record = blocks.cloths.emplace_back();
    record.firstBlock = static_cast<float>(blocks.records.size());
    record.blockCount = static_cast<float>(count);
    for (std::uint32_t first = 0; first < nodes; first += shared::kReportBlock)
      blocks.records.push_back({static_cast<float>(cloth), static_cast<float>(first),
                                static_cast<float>(isMesh ? inMeshes + first : 0), 0});
    if (isMesh) inMeshes += nodes;
  }
  return blocks;
}

template <typename Record>
Buffer uploadOf(const vulkan::Device& device, const std::vector<Record>& records) {
  Buffer upload(device, BufferPurpose::upload, records.size() * sizeof(Record));
  std::memcpy(upload.mapped().data(), records.data(), upload.bytes());
  return upload;
}

// Upper end of the bin in which 99 % of all springs are reached. The last bin has no upper end.
float p99Of(std::span<const std::uint32_t> bins, std::uint64_t all) {
  const std::uint64_t rank = (99 * all + 99) / 100;
  std::uint64_t before = 0;
  for (std::uint32_t bin = 0; bin + 1 < bins.size(); ++bin)
    if ((before += bins[bin]) >= rank) return std::bit_cast<float>((shared::kStretchFirst + bin) << 18);
  return std::numeric_limits<float>::infinity();
}

}  // namespace

std::vector<SpringStiffness> springStiffness(std::span<const model::Cloth> cloths) {
  std::vector<SpringStiffness> all;
  for (const model::Cloth& cloth : cloths)
    all.push_back({cloth.structural.stiffness, cloth.shear.stiffness, cloth.bend.stiffness});
  return all;
}

ReportStage::ReportStage(const vulkan::Device& device, std::span<const shared::ClothRecord> cloths,
                         const StateBuffers& state, const MeshSprings& meshes, const SolidStage* solids,
                         std::uint32_t workgroupSize)
    : ReportStage(
          device, blocksOf(cloths), state, meshes, solids,
          std::min(workgroupSize == 0 ? 64 : workgroupSize, device.limits().maxWorkgroupInvocations)) {}

ReportStage::ReportStage(const vulkan::Device& device, ReportBlocks blocks, const StateBuffers& state,
                         const MeshSprings& meshes, const SolidStage* solids, std::uint32_t workgroupSize)
    : workgroupSize_(workgroupSize),
      of_(std::move(blocks)),
      blockUpload_(uploadOf(device, of_.records)),
      blocks_(device, BufferPurpose::texels, blockUpload_.bytes()),
      cloths_(device, BufferPurpose::texels, of_.cloths.size() * sizeof(shared::ReportClothRecord)),
      runs_(device, BufferPurpose::state,
            of_.records.size() * shared::kReportRuns * sizeof(shared::ReportSums)),
      sums_(device, BufferPurpose::state, of_.cloths.size() * sizeof(shared::ReportSums)),
      counts_(device, BufferPurpose::state,
              of_.cloths.size() * shared::kReportCounts * sizeof(std::uint32_t)),
      readback_(device, BufferPurpose::readback, sums_.bytes() + counts_.bytes()),
      clothUploads_{uploadOf(device, of_.cloths), uploadOf(device, of_.cloths)},
      measure_(bindStates(device, {device, kernels::measure_cloths, workgroupSize},
                          [&](std::size_t present) {
                            return BufferList{&state.cloths,
                                              &blocks_,
                                              &cloths_,
                                              state.positions[present],
                                              state.velocities[present],
                                              meshes.nodes != nullptr ? meshes.nodes : &blocks_,
                                              meshes.ends != nullptr ? meshes.ends : &blocks_,
                                              &runs_,
                                              &counts_};
                          })),
      penetrations_(bindStates(device, {device, kernels::measure_penetrations, workgroupSize},
                               [&](std::size_t present) {
                                 return BufferList{&state.cloths, &blocks_,         state.positions[present],
                                                   &counts_,      &state.colliders, &state.nearColliders};
                               })),
      addUp_(device, {device, kernels::add_up_cloths, workgroupSize}, {&cloths_, &runs_, &sums_}) {
  if (solids != nullptr)
    solidDepths_ =
        bindStates(device, {device, kernels::measure_solids, workgroupSize, solids->specialisation()},
                   [&](std::size_t present) {
                     return BufferList{&state.cloths, &blocks_,          state.positions[present],
                                       &counts_,      &solids->solids(), &state.colliders};
                   });
}

void ReportStage::record(vulkan::Recorder& recorder, std::uint32_t present,
                         std::span<const SpringStiffness> stiffness, const model::Vec3& gravity,
                         const model::Vec3& origin, const shared::CollisionPush& collision,
                         std::uint32_t solidCount) {
  assert(stiffness.size() == of_.cloths.size());
  for (std::size_t i = 0; i < stiffness.size(); ++i) {
    of_.cloths[i].structuralStiffness = stiffness[i].structural;
    of_.cloths[i].shearStiffness = stiffness[i].shear;
    of_.cloths[i].bendStiffness = stiffness[i].bend;
  }
  slot_ = 1 - slot_;
  const Buffer& upload = clothUploads_[slot_];
  std::memcpy(upload.mapped().data(), of_.cloths.data(), upload.bytes());
  recorder.barrier();
  if (!std::exchange(tabled_, true)) recorder.copy(blockUpload_, blocks_, blocks_.bytes());
  recorder.copy(upload, cloths_, upload.bytes());
  recorder.fill(counts_, 0, counts_.bytes());
  recorder.barrier();
  const auto blocks = static_cast<std::uint32_t>(of_.records.size());
  recorder.dispatch(
      measure_[present],
      shared::MeasurePush{.gravity = {gravity.x(), gravity.y(), gravity.z(), gravity.dot(origin)},
                          .blockCount = blocks,
                          .reserved0 = 0,
                          .reserved1 = 0,
                          .reserved2 = 0},
      std::uint64_t{blocks} * shared::kReportRuns);
  const shared::PenetrationPush penetration{
      .collision = collision, .blockCount = blocks, .solidCount = solidCount, .reserved0 = 0, .reserved1 = 0};
  const std::uint64_t depthThreads = std::uint64_t{blocks} * (shared::kReportBlock / shared::kReportDepths);
  if (collision.colliderCount > 0)
    recorder.dispatch(penetrations_[present], penetration, depthThreads,
                      std::uint64_t{shared::kReportDepths} * collision.nodeWork);
  if (solidCount > 0)
    recorder.dispatch((*solidDepths_)[present], penetration, depthThreads,
                      std::uint64_t{shared::kReportDepths} * solidCount * kSolidDepthWork);
  recorder.barrier();
  recorder.dispatch(addUp_, of_.cloths.size() * workgroupSize_);
  recorder.barrier();
  recorder.copy(sums_, readback_, sums_.bytes());
  recorder.copy(counts_, readback_, counts_.bytes(), 0, sums_.bytes());
}

std::vector<ClothReport> ReportStage::collect() const {
  const std::span<const std::byte> bytes = readback_.mapped();
  std::vector<ClothReport> reports;
  for (std::size_t cloth = 0; cloth < of_.cloths.size(); ++cloth) {
    shared::ReportSums sums;
    std::memcpy(&sums, bytes.data() + cloth * sizeof(sums), sizeof(sums));
    std::array<std::uint32_t, shared::kReportCounts> counts;
    std::memcpy(counts.data(), bytes.data() + sums_.bytes() + cloth * sizeof(counts), sizeof(counts));
    const std::span<const std::uint32_t> bins = std::span(counts).first(shared::kStretchBins);
    const std::uint64_t springs = std::accumulate(bins.begin(), bins.end(), std::uint64_t{0});
    ClothReport& report = reports.emplace_back();
    report.strainMax = sums.largest;
    report.strainP99 = std::min(p99Of(bins, springs), sums.largest);
    report.strainMean = sums.strain / static_cast<float>(springs);
    report.kineticEnergy = sums.kinetic;
    report.elasticEnergy = sums.elastic;
    report.gravityEnergy = sums.gravity;
    report.penetration = std::bit_cast<float>(counts[shared::kStretchBins]);
  }
  return reports;
}

}  // namespace clothstream::simulation
