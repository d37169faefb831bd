// SPDX-License-Identifier: MIT
// Prediction on the device: the CPU fits weights, to frames some frames back, and makes packets.
#include <array>

#include "proto/codec/hierarchical/weight_plan.h"
#include "server/encode/device_output.h"
#include "server/encode/device_predictor.h"
#include "server/encode/encode_stage.h"

namespace clothstream::encode {
namespace {

using codec::hierarchical::FitSchedule;
using codec::hierarchical::Phase;
using codec::hierarchical::WeightPlan;

const codec::hierarchical::Weights kStartingWeights = codec::hierarchical::startingWeights();

class HierarchicalDeviceStage final : public EncodeStage {
 public:
  HierarchicalDeviceStage(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                          const codec::StreamLayout& layout)
      : predictor_(device, simulation, layout),
        fitted_(predictor_.hierarchy()),
        plan_(predictor_.hierarchy(), 1, kWeightLag),
        output_(layout.codec == codec::kCodecPacked ? makePackedOutput(device, predictor_, layout)
                                                    : makeCodedOutput(predictor_, layout)) {}

  std::size_t packetBound() const override { return output_->packetBound(); }

  void record(vulkan::Recorder& recorder, std::uint32_t slot, bool predicted) override {
    recordedSinceKey_ = predicted ? recordedSinceKey_ + 1 : 0;
    const codec::hierarchical::Weights* planned = plan_.planned(recorded_++, recordedSinceKey_);
    const DevicePredictor::FrameWeights weights{planned, predicted ? planned : &kStartingWeights};
    std::array<Phase, FitSchedule::kMaxChunks> chunks;
    const std::size_t count = fitted_.select(recordedSinceKey_, chunks);
    predictor_.record(recorder, slot, recordedSinceKey_, planned != nullptr ? &weights : nullptr,
                      std::span(chunks).first(count));
    output_->record(recorder, slot);
  }

  EncodedFrame entropyCode(const RecordedFrame& frame, std::span<std::byte> out) override;

 private:
  DevicePredictor predictor_;
  FitSchedule fitted_;
  // Of the device's thread.
  std::uint64_t recorded_ = 0;
  std::uint32_t recordedSinceKey_ = 0;
  // Of the thread that entropy-codes; but what is planned is read by the device's.
  WeightPlan plan_;
  std::unique_ptr<DeviceOutput> output_;
  std::uint32_t sinceKey_ = 0;
  std::array<std::byte, WeightPlan::kMaxBytes> weightBytes_{};
};

EncodedFrame HierarchicalDeviceStage::entropyCode(const RecordedFrame& frame, std::span<std::byte> out) {
  const bool key = frame.kind == codec::PacketKind::key;
  const codec::FrameRole role{.tick = frame.tick, .kind = frame.kind, .referenceTick = frame.referenceTick};
  const shared::SlotStatus& status = predictor_.status(frame.slot);
  sinceKey_ = key ? 0 : sinceKey_ + 1;
  plan_.begin(role);
  const std::size_t weightBytes = plan_.write(!key && status.moved == 0, weightBytes_.data());
  const DeviceOutput::Written written =
      output_->write(frame.slot, role, std::span(weightBytes_).first(weightBytes), out);
  std::array<Phase, FitSchedule::kMaxChunks> chunks;
  const std::size_t count = fitted_.select(sinceKey_, chunks);
  for (std::size_t i = 0; i < count; ++i)
    plan_.add(chunks[i].weightClass, predictor_.products(frame.slot, i));
  plan_.end(!written.any);
  return {.bytes = written.bytes,
          .reconstructionHash = std::uint64_t{status.hashHigh} << 32 | status.hashLow,
          .layer = role.layer,
          .referenceTick = role.referenceTick};
}

}  // namespace

std::unique_ptr<EncodeStage> makeHierarchicalDeviceStage(const vulkan::Device& device,
                                                         const simulation::ClothSimulation& simulation,
                                                         const codec::StreamLayout& layout) {
  return std::make_unique<HierarchicalDeviceStage>(device, simulation, layout);
}

}  // namespace clothstream::encode
