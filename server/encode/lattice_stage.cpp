// SPDX-License-Identifier: MIT
// Codec 1: positions and normals are quantised and predicted on the device, and entropy-coded on the CPU.
#include <array>
#include <cassert>
#include <cstring>
#include <vector>

#include "kernels/measure_predictions.h"
#include "kernels/quantise_vertices.h"
#include "kernels/write_residuals.h"
#include "proto/codec/lattice/lattice.h"
#include "proto/codec/lattice/packet_writer.h"
#include "proto/codec/lattice/prediction.h"
#include "proto/codec/lattice/residual_planes.h"
#include "server/encode/encode_stage.h"
#include "server/vulkan/kernel.h"
#include "shaders/encode/frame.h"

namespace clothstream::encode {
namespace {

using vulkan::BindingKind;
using vulkan::Buffer;
using vulkan::BufferPurpose;
using vulkan::Kernel;

constexpr std::uint32_t kWorkgroupSize = 64;
// Vertices (or samples) that one invocation of the adding kernels takes: few atomics, enough invocations.
constexpr std::uint32_t kVerticesPerInvocation = 8;

constexpr std::size_t wordsOf(std::size_t bytes) {
  return (bytes + 3) / 4;
}
constexpr std::uint64_t ceilDivide(std::uint64_t a, std::uint64_t b) {
  return (a + b - 1) / b;
}

std::vector<std::uint32_t> neighbourTable(const codec::StreamLayout& layout) {
  std::vector<std::uint32_t> table;
  table.reserve(layout.vertexCount());
  for (const codec::ClothLayout& cloth : layout.cloths) {
    const std::uint32_t columns = cloth.columns == 0 ? cloth.vertexCount : cloth.columns;
    for (std::uint32_t i = 0; i < cloth.vertexCount; ++i) {
      table.push_back((i % columns > 0 ? 0x80000000u : 0u) | (i >= columns ? columns : 0u));
    }
  }
  return table;
}

vulkan::KernelDescription describe(const char* name, std::span<const std::uint32_t> spirv, bool hasNormals,
                                   std::vector<BindingKind> bindings) {
  return {.name = name,
          .spirv = spirv,
          .bindings = std::move(bindings),
          .pushConstantBytes = sizeof(shared::EncodePush),
          .workgroupSize = kWorkgroupSize,
          .specialisation = {hasNormals ? 1u : 0u}};
}

// How a slot's readback lies: status, planes of positions, plane of normals, each from a word's start
// (write_residuals.comp).
struct SlotShape {
  explicit SlotShape(std::size_t vertices, bool hasNormals)
      : planeBytes(codec::positionPlaneBytes(vertices)),
        normalBytes(hasNormals ? codec::normalPlaneBytes(vertices) : 0) {}

  std::size_t planeStart(std::size_t plane) const {
    return sizeof(shared::FrameStatus) + 4 * plane * wordsOf(planeBytes);
  }
  std::size_t normalStart() const { return planeStart(codec::kMaxPlanes); }
  std::size_t bytes() const { return normalStart() + 4 * wordsOf(normalBytes); }

  std::size_t planeBytes, normalBytes;
};

class LatticeStage final : public EncodeStage {
 public:
  LatticeStage(const vulkan::Device& device, const simulation::ClothSimulation& source,
               const codec::StreamLayout& layout);

  std::size_t packetBound() const override { return writer_.packetBound(); }
  void record(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted) override;
  EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out) override;

 private:
  void recordKernels(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted);

  const simulation::ClothSimulation& simulation_;
  std::uint32_t vertices_;
  bool hasNormals_;
  codec::LatticeScale scale_;
  SlotShape shape_;
  codec::PacketWriter writer_;

  // The integers of the newest frame and of the one before, by turns.
  std::array<Buffer, 2> lattices_;
  Buffer neighbours_, neighbourUpload_, status_;
  std::array<Buffer, kFrameSlots> slots_;
  Kernel quantise_, measure_, write_;
  // quantise_: by the present positions, then the lattice that is written; the others: by that lattice, then
  // the slot.
  std::vector<vulkan::Bindings> quantiseBindings_, measureBindings_, writeBindings_;

  // Of the device's thread.
  bool started_ = false;
  std::uint32_t presentLattice_ = 0;
};

LatticeStage::LatticeStage(const vulkan::Device& device, const simulation::ClothSimulation& source,
                           const codec::StreamLayout& layout)
    : simulation_(source),
      vertices_(layout.vertexCount()),
      hasNormals_(layout.normals == codec::NormalMode::octahedral),
      scale_(codec::latticeScale(layout.maxError)),
      shape_(vertices_, hasNormals_),
      writer_(layout),
      neighbours_(device, BufferPurpose::state, vertices_ * sizeof(std::uint32_t)),
      neighbourUpload_(device, BufferPurpose::upload, neighbours_.bytes()),
      status_(device, BufferPurpose::state, sizeof(shared::FrameStatus)),
      quantise_(device, describe("quantise_vertices", kernels::quantise_vertices, hasNormals_,
                                 {BindingKind::texels, BindingKind::texels, BindingKind::storage,
                                  BindingKind::storage})),
      measure_(device, describe("measure_predictions", kernels::measure_predictions, hasNormals_,
                                {BindingKind::storage, BindingKind::storage, BindingKind::storage,
                                 BindingKind::storage})),
      write_(device, describe("write_residuals", kernels::write_residuals, hasNormals_,
                              {BindingKind::storage, BindingKind::storage, BindingKind::storage,
                               BindingKind::storage, BindingKind::storage})) {
  assert(vertices_ == simulation_.nodeCount());
  const std::size_t channels = codec::kPositionChannels + (hasNormals_ ? codec::kNormalChannels : 0);
  for (Buffer& lattice : lattices_) {
    lattice = Buffer(device, BufferPurpose::state, channels * vertices_ * sizeof(std::int32_t));
  }
  for (Buffer& slot : slots_) slot = Buffer(device, BufferPurpose::readback, shape_.bytes());
  for (std::uint32_t positions = 0; positions < 2; ++positions) {
    for (const Buffer& lattice : lattices_) {
      quantiseBindings_.emplace_back(
          device, quantise_,
          std::initializer_list<const Buffer*>{&simulation_.positions(positions), &simulation_.normals(),
                                               &lattice, &status_});
    }
  }
  for (std::uint32_t lattice = 0; lattice < 2; ++lattice) {
    const Buffer &present = lattices_[lattice], &reference = lattices_[1 - lattice];
    measureBindings_.emplace_back(
        device, measure_, std::initializer_list<const Buffer*>{&present, &reference, &neighbours_, &status_});
    for (const Buffer& slot : slots_) {
      writeBindings_.emplace_back(
          device, write_,
          std::initializer_list<const Buffer*>{&present, &reference, &neighbours_, &status_, &slot});
    }
  }
  const std::vector<std::uint32_t> table = neighbourTable(layout);
  std::memcpy(neighbourUpload_.mapped().data(), table.data(), neighbourUpload_.bytes());
}

void LatticeStage::record(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted) {
  presentLattice_ = 1 - presentLattice_;
  recorder.fill(status_, 0, sizeof(shared::FrameStatus));
  if (!started_) recorder.copy(neighbourUpload_, neighbours_, neighbours_.bytes());
  recorder.barrier();
  recordKernels(recorder, slot, predicted);
  started_ = true;
}

void LatticeStage::recordKernels(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted) {
  const shared::EncodePush push{vertices_, predicted ? 1u : 0u, scale_.step, scale_.inverseStep};
  recorder.dispatch(quantiseBindings_[2 * simulation_.presentIndex() + presentLattice_], push,
                    ceilDivide(vertices_, kVerticesPerInvocation));
  recorder.barrier();
  recorder.dispatch(measureBindings_[presentLattice_], push,
                    ceilDivide(vertices_, kVerticesPerInvocation * codec::kCostStride));
  recorder.barrier();
  recorder.dispatch(writeBindings_[kFrameSlots * presentLattice_ + slot], push,
                    wordsOf(shape_.planeBytes) + wordsOf(shape_.normalBytes));
  recorder.barrier();
  recorder.copy(status_, slots_[slot], sizeof(shared::FrameStatus));
}

EncodedFrame LatticeStage::entropyCode(const RecordedFrame& frame, std::span<std::byte> out) {
  const std::span<const std::byte> slot = slots_[frame.slot].mapped();
  shared::FrameStatus status;
  std::memcpy(&status, slot.data(), sizeof status);

  const bool predicted = frame.kind == codec::PacketKind::predicted;
  codec::FrameResiduals residuals{.kind = frame.kind,
                                  .tick = frame.tick,
                                  .referenceTick = frame.referenceTick,
                                  .positionPrediction = codec::cheapest(status.positionCosts, predicted),
                                  .normalPrediction = codec::cheapest(status.normalCosts, predicted),
                                  .planeCount = codec::planeCount(status.residualBits),
                                  .planes = {},
                                  .normalPlane = slot.subspan(shape_.normalStart(), shape_.normalBytes)};
  for (std::size_t p = 0; p < residuals.planeCount; ++p) {
    residuals.planes[p] = slot.subspan(shape_.planeStart(p), shape_.planeBytes);
  }
  return {.bytes = writer_.write(residuals, out),
          .reconstructionHash = std::uint64_t{status.hashHigh} << 32 | status.hashLow};
}

}  // namespace

std::unique_ptr<EncodeStage> makeLatticeStage(const vulkan::Device& device,
                                              const simulation::ClothSimulation& simulation,
                                              const codec::StreamLayout& layout) {
  return std::make_unique<LatticeStage>(device, simulation, layout);
}

}  // namespace clothstream::encode
