// SPDX-License-Identifier: MIT
// Frames from simulation state.
#include "server/encode/frame_encoder.h"

#include <array>
#include <atomic>
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

}  // namespace

codec::StreamLayout streamLayout(const scene::Scene& scene, std::uint32_t epoch) {
  codec::StreamLayout layout{.epoch = epoch,
                             .maxError = scene.stream.maxError,
                             .normals = scene.stream.normals == scene::Normals::octahedral
                                            ? codec::NormalMode::octahedral
                                            : codec::NormalMode::none,
                             .cloths = {}};
  for (const scene::Cloth& cloth : scene.cloths) {
    layout.cloths.push_back({cloth.grid.nodeCount(), cloth.grid.rows, cloth.grid.columns});
  }
  return layout;
}

struct FrameEncoder::State {
  State(const vulkan::Device& device, const simulation::ClothSimulation& source,
        const codec::StreamLayout& layout);

  std::uint32_t takeSlot();
  void recordKernels(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted);

  const simulation::ClothSimulation& simulation;
  std::uint32_t vertices;
  bool hasNormals;
  codec::LatticeScale scale;
  SlotShape shape;
  codec::PacketWriter writer;

  // The integers of the newest frame and of the one before, by turns.
  std::array<Buffer, 2> lattices;
  Buffer neighbours, neighbourUpload, status;
  std::array<Buffer, kSlots> slots;
  Kernel quantise, measure, write;
  // quantise: by the present positions, then the lattice that is written; the others: by that lattice, then
  // the slot.
  std::vector<vulkan::Bindings> quantiseBindings, measureBindings, writeBindings;

  // Of the device's thread.
  bool started = false;
  bool hasReference = false;
  std::uint64_t tick = 0;
  std::uint32_t presentLattice = 0;
  // Set by record(), cleared by entropyCode().
  std::array<std::atomic<bool>, kSlots> taken{};
};

FrameEncoder::State::State(const vulkan::Device& device, const simulation::ClothSimulation& source,
                           const codec::StreamLayout& layout)
    : simulation(source),
      vertices(layout.vertexCount()),
      hasNormals(layout.normals == codec::NormalMode::octahedral),
      scale(codec::latticeScale(layout.maxError)),
      shape(vertices, hasNormals),
      writer(layout),
      neighbours(device, BufferPurpose::state, vertices * sizeof(std::uint32_t)),
      neighbourUpload(device, BufferPurpose::upload, neighbours.bytes()),
      status(device, BufferPurpose::state, sizeof(shared::FrameStatus)),
      quantise(device, describe("quantise_vertices", kernels::quantise_vertices, hasNormals,
                                {BindingKind::texels, BindingKind::texels, BindingKind::storage,
                                 BindingKind::storage})),
      measure(device, describe("measure_predictions", kernels::measure_predictions, hasNormals,
                               {BindingKind::storage, BindingKind::storage, BindingKind::storage,
                                BindingKind::storage})),
      write(device, describe("write_residuals", kernels::write_residuals, hasNormals,
                             {BindingKind::storage, BindingKind::storage, BindingKind::storage,
                              BindingKind::storage, BindingKind::storage})) {
  assert(vertices == simulation.nodeCount());
  const std::size_t channels = codec::kPositionChannels + (hasNormals ? codec::kNormalChannels : 0);
  for (Buffer& lattice : lattices) {
    lattice = Buffer(device, BufferPurpose::state, channels * vertices * sizeof(std::int32_t));
  }
  for (Buffer& slot : slots) slot = Buffer(device, BufferPurpose::readback, shape.bytes());
  for (std::uint32_t positions = 0; positions < 2; ++positions) {
    for (const Buffer& lattice : lattices) {
      quantiseBindings.emplace_back(
          device, quantise,
          std::initializer_list<const Buffer*>{&simulation.positions(positions), &simulation.normals(),
                                               &lattice, &status});
    }
  }
  for (std::uint32_t lattice = 0; lattice < 2; ++lattice) {
    const Buffer &present = lattices[lattice], &reference = lattices[1 - lattice];
    measureBindings.emplace_back(
        device, measure, std::initializer_list<const Buffer*>{&present, &reference, &neighbours, &status});
    for (const Buffer& slot : slots) {
      writeBindings.emplace_back(
          device, write,
          std::initializer_list<const Buffer*>{&present, &reference, &neighbours, &status, &slot});
    }
  }
  const std::vector<std::uint32_t> table = neighbourTable(layout);
  std::memcpy(neighbourUpload.mapped().data(), table.data(), neighbourUpload.bytes());
}

std::uint32_t FrameEncoder::State::takeSlot() {
  std::uint32_t slot = 0;
  while (slot < kSlots && taken[slot].load(std::memory_order_acquire)) ++slot;
  assert(slot < kSlots);  // canRecord() says whether one is free
  taken[slot].store(true, std::memory_order_relaxed);
  return slot;
}

void FrameEncoder::State::recordKernels(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted) {
  const shared::EncodePush push{vertices, predicted ? 1u : 0u, scale.step, scale.inverseStep};
  recorder.dispatch(quantiseBindings[2 * simulation.presentIndex() + presentLattice], push,
                    ceilDivide(vertices, kVerticesPerInvocation));
  recorder.barrier();
  recorder.dispatch(measureBindings[presentLattice], push,
                    ceilDivide(vertices, kVerticesPerInvocation * codec::kCostStride));
  recorder.barrier();
  recorder.dispatch(writeBindings[kSlots * presentLattice + slot], push,
                    wordsOf(shape.planeBytes) + wordsOf(shape.normalBytes));
  recorder.barrier();
  recorder.copy(status, slots[slot], sizeof(shared::FrameStatus));
}

FrameEncoder::FrameEncoder(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                           const codec::StreamLayout& layout)
    : state_(std::make_unique<State>(device, simulation, layout)) {}

FrameEncoder::~FrameEncoder() = default;

bool FrameEncoder::canRecord() const {
  for (const std::atomic<bool>& taken : state_->taken) {
    if (!taken.load(std::memory_order_acquire)) return true;
  }
  return false;
}

RecordedFrame FrameEncoder::record(vulkan::Recorder& recorder, std::uint64_t tick, bool forceKey) {
  State& s = *state_;
  assert(!s.hasReference || tick > s.tick);
  const bool predicted = s.hasReference && !forceKey;
  const RecordedFrame frame{.slot = s.takeSlot(),
                            .tick = tick,
                            .kind = predicted ? codec::PacketKind::predicted : codec::PacketKind::key,
                            .referenceTick = predicted ? s.tick : 0};
  s.presentLattice = 1 - s.presentLattice;
  recorder.beginStage("encode");
  recorder.barrier();
  recorder.fill(s.status, 0, sizeof(shared::FrameStatus));
  if (!s.started) recorder.copy(s.neighbourUpload, s.neighbours, s.neighbours.bytes());
  recorder.barrier();
  s.recordKernels(recorder, frame.slot, predicted);
  s.started = true;
  s.hasReference = true;
  s.tick = tick;
  return frame;
}

void FrameEncoder::forgetHistory() {
  state_->hasReference = false;
}

EncodedFrame FrameEncoder::entropyCode(const RecordedFrame& frame, std::span<std::byte> out) {
  State& s = *state_;
  const std::span<const std::byte> slot = s.slots[frame.slot].mapped();
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
                                  .normalPlane = slot.subspan(s.shape.normalStart(), s.shape.normalBytes)};
  for (std::size_t p = 0; p < residuals.planeCount; ++p) {
    residuals.planes[p] = slot.subspan(s.shape.planeStart(p), s.shape.planeBytes);
  }
  const EncodedFrame encoded{.bytes = s.writer.write(residuals, out),
                             .reconstructionHash = std::uint64_t{status.hashHigh} << 32 | status.hashLow};
  s.taken[frame.slot].store(false, std::memory_order_release);
  return encoded;
}

std::size_t FrameEncoder::packetBound() const {
  return state_->writer.packetBound();
}

}  // namespace clothstream::encode
