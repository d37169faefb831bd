// SPDX-License-Identifier: MIT
// Encodes simulation states as frames: slots, kinds and references.
#include "server/encode/frame_encoder.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <utility>

#include "server/encode/device_predictor.h"
#include "server/encode/encode_stage.h"
#include "server/model/mesh.h"
#include "server/model/origin.h"

namespace clothstream::encode {
namespace {

std::vector<std::uint32_t> trianglesOf(const model::Mesh& mesh) {
  std::vector<std::uint32_t> corners;
  corners.reserve(3 * mesh.shape.triangles.size());
  for (const model::Triangle& triangle : mesh.shape.triangles)
    corners.insert(corners.end(), triangle.begin(), triangle.end());
  return corners;
}

std::vector<float> coordinatesOf(const model::Mesh& mesh) {
  std::vector<float> coordinates;
  coordinates.reserve(3 * mesh.shape.positions.size());
  for (const model::Vec3& position : mesh.shape.positions)
    coordinates.insert(coordinates.end(), {position.x(), position.y(), position.z()});
  return coordinates;
}

// Frees a slot at the end of a scope, also if an exception leaves it.
struct Release {
  std::atomic<bool>& taken;
  ~Release() { taken.store(false, std::memory_order_release); }
};

}  // namespace

codec::StreamLayout streamLayout(const model::Scene& scene, std::uint32_t epoch) {
  const bool normals = scene.stream.normals == model::Normals::octahedral;
  codec::StreamLayout layout{.epoch = epoch,
                             .maxError = scene.stream.maxError,
                             .normals = normals ? codec::NormalMode::octahedral : codec::NormalMode::none,
                             .qualities = scene.stream.qualities,
                             .cloths = {}};
  const model::Vec3 origin = model::originOf(scene);
  std::ranges::copy(origin, layout.origin.begin());
  for (const model::Cloth& cloth : scene.cloths) {
    if (cloth.mesh)
      layout.cloths.push_back({.vertexCount = cloth.nodeCount(),
                               .triangles = trianglesOf(*cloth.mesh),
                               .restPositions = coordinatesOf(*cloth.mesh)});
    else
      layout.cloths.push_back({cloth.nodeCount(), cloth.grid.rows, cloth.grid.columns});
  }
  return layout;
}

struct FrameEncoder::State {
  std::uint32_t takeSlot() {
    std::uint32_t slot = 0;
    while (slot < kSlots && taken[slot].load(std::memory_order_acquire)) ++slot;
    assert(slot < kSlots);  // canRecord() says whether one is free
    taken[slot].store(true, std::memory_order_relaxed);
    return slot;
  }

  std::unique_ptr<EncodeStage> stage;
  // Belong to the device's thread.
  bool hasReference = false;
  std::uint64_t tick = 0;
  // Set by record(), cleared by entropyCode().
  std::array<std::atomic<bool>, kSlots> taken{};
};

FrameEncoder::FrameEncoder(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                           const codec::StreamLayout& layout, Prediction prediction, codec::Workers* workers)
    : state_(std::make_unique<State>()) {
  assert(layout.vertexCount() == simulation.nodeCount());
  const bool onDevice = prediction == Prediction::automatic
                            ? !device.isSoftware() && DevicePredictor::supports(device, layout)
                            : prediction == Prediction::onDevice;
  state_->stage = onDevice ? makeHierarchicalDeviceStage(device, simulation, layout)
                           : makeHierarchicalHostStage(device, simulation, layout,
                                                       codec::Encoder::make(layout, {.workers = workers}));
}

FrameEncoder::FrameEncoder(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                           const codec::StreamLayout& layout, std::unique_ptr<codec::Encoder> encoder)
    : state_(std::make_unique<State>()) {
  state_->stage = makeHierarchicalHostStage(device, simulation, layout, std::move(encoder));
}

FrameEncoder::~FrameEncoder() = default;

bool FrameEncoder::canRecord() const {
  for (const std::atomic<bool>& taken : state_->taken) {
    if (!taken.load(std::memory_order_acquire)) return true;
  }
  return false;
}

bool FrameEncoder::isIdle() const {
  return std::ranges::none_of(
      state_->taken, [](const std::atomic<bool>& taken) { return taken.load(std::memory_order_acquire); });
}

RecordedFrame FrameEncoder::record(vulkan::Recorder& recorder, std::uint64_t tick, bool forceKey) {
  State& s = *state_;
  assert(!s.hasReference || tick > s.tick);
  const bool predicted = s.hasReference && !forceKey;
  const RecordedFrame frame{.slot = s.takeSlot(),
                            .tick = tick,
                            .kind = predicted ? codec::PacketKind::predicted : codec::PacketKind::key,
                            .referenceTick = predicted ? s.tick : 0};
  recorder.beginStage("encode");
  recorder.barrier();
  s.stage->record(recorder, frame.slot, predicted);
  s.hasReference = true;
  s.tick = tick;
  return frame;
}

void FrameEncoder::forgetHistory() {
  state_->hasReference = false;
}

EncodedFrame FrameEncoder::entropyCode(const RecordedFrame& frame, std::span<std::byte> out) {
  const Release release{state_->taken[frame.slot]};
  return state_->stage->entropyCode(frame, out);
}

std::size_t FrameEncoder::packetBound() const {
  return state_->stage->packetBound();
}

}  // namespace clothstream::encode
