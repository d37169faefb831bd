// SPDX-License-Identifier: MIT
// Prediction on the device. The CPU fits the weights to older frames, codes the residuals and writes packets.
#include <algorithm>
#include <array>
#include <memory>

#include "proto/codec/hierarchical/frame_writer.h"
#include "proto/codec/hierarchical/weight_plan.h"
#include "server/encode/device_predictor.h"
#include "server/encode/encode_stage.h"

namespace clothstream::encode {
namespace {

using codec::hierarchical::FitSchedule;
using codec::hierarchical::Phase;
using codec::hierarchical::WeightPlan;

const codec::hierarchical::Weights kStartingWeights = codec::hierarchical::startingWeights();

codec::FrameRole roleOf(const RecordedFrame& frame) {
  return {.tick = frame.tick, .kind = frame.kind, .referenceTick = frame.referenceTick};
}

class HierarchicalDeviceStage final : public EncodeStage {
 public:
  HierarchicalDeviceStage(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                          const codec::StreamLayout& layout)
      : predictor_(device, simulation, layout),
        fitted_(predictor_.hierarchy()),
        plan_(predictor_.hierarchy(), kWeightLag),
        writer_(layout) {}

  std::size_t packetBound() const override { return writer_.packetBound(); }

  void record(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted) override {
    recordedSinceKey_ = predicted ? recordedSinceKey_ + 1 : 0;
    const codec::hierarchical::Weights* planned = plan_.planned(recorded_++, recordedSinceKey_);
    const DevicePredictor::FrameWeights weights{planned, predicted ? planned : &kStartingWeights};
    std::array<Phase, FitSchedule::kMaxChunks> chunks;
    const std::size_t count = fitted_.select(recordedSinceKey_, chunks);
    predictor_.record(recorder, slot, recordedSinceKey_, planned != nullptr ? &weights : nullptr,
                      std::span(chunks).first(count));
  }

  EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out) override;

 private:
  // These give the writer all residuals of a frame, or of one phase. They return whether a vertex stays or
  // has a residual that is not 0.
  bool addResiduals(std::uint32_t slot);
  bool addPhase(std::uint32_t slot, const Phase& phase);

  DevicePredictor predictor_;
  FitSchedule fitted_;
  // Belong to the device's thread.
  std::uint64_t recorded_ = 0;
  std::uint32_t recordedSinceKey_ = 0;
  // Belong to the thread that entropy-codes, but the device's thread reads the planned weights.
  WeightPlan plan_;
  codec::hierarchical::FrameWriter writer_;
  codec::hierarchical::ChunkResiduals chunk_;
  std::uint32_t sinceKey_ = 0;
  std::array<std::byte, WeightPlan::kMaxBytes> weightBytes_{};
};

bool HierarchicalDeviceStage::addResiduals(std::uint32_t slot) {
  bool any = false;
  writer_.begin();
  const codec::hierarchical::Hierarchy& hierarchy = predictor_.hierarchy();
  for (std::size_t i = 0; i < hierarchy.phases.size(); ++i) {
    any = addPhase(slot, hierarchy.phases[i]) || any;
    if (i + 1 == hierarchy.coarsePhases) writer_.endCoarse();
  }
  for (const std::uint32_t normal : predictor_.normalResiduals(slot))
    writer_.addNormal(static_cast<std::int8_t>(normal), static_cast<std::int8_t>(normal >> 8));
  return any;
}

bool HierarchicalDeviceStage::addPhase(std::uint32_t slot, const Phase& phase) {
  bool any = false;
  writer_.beginPhase();
  for (std::uint32_t begin = phase.begin; begin < phase.end; begin += codec::hierarchical::kChunk) {
    const std::uint32_t count = std::min(codec::hierarchical::kChunk, phase.end - begin);
    any = predictor_.read(slot, begin, count, chunk_) || any;
    writer_.add(chunk_, count);
  }
  writer_.endPhase(any);
  return any;
}

EncodedFrame HierarchicalDeviceStage::entropyCode(const RecordedFrame& frame, std::span<std::byte> out) {
  const bool key = frame.kind == codec::PacketKind::key;
  const codec::FrameRole role = roleOf(frame);
  sinceKey_ = key ? 0 : sinceKey_ + 1;
  plan_.begin(key);
  const shared::SlotStatus& status = predictor_.status(frame.slot);
  const bool atRest = !key && status.moved == 0;
  const std::size_t weightBytes = plan_.write(atRest, weightBytes_.data());
  const bool any = addResiduals(frame.slot);
  const std::size_t bytes = writer_.write(role, std::span(weightBytes_).first(weightBytes), out);
  std::array<Phase, FitSchedule::kMaxChunks> chunks;
  const std::size_t count = fitted_.select(sinceKey_, chunks);
  for (std::size_t i = 0; i < count; ++i)
    plan_.add(chunks[i].weightClass, predictor_.products(frame.slot, i));
  plan_.end(!any);
  return {.bytes = bytes,
          .reconstructionHash = std::uint64_t{status.hashHigh} << 32 | status.hashLow,
          .kind = role.kind,
          .referenceTick = role.referenceTick};
}

}  // namespace

std::unique_ptr<EncodeStage> makeHierarchicalDeviceStage(const vulkan::Device& device,
                                                         const simulation::ClothSimulation& simulation,
                                                         const codec::StreamLayout& layout) {
  return std::make_unique<HierarchicalDeviceStage>(device, simulation, layout);
}

}  // namespace clothstream::encode
