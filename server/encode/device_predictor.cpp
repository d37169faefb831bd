// SPDX-License-Identifier: MIT
// Prediction and choice of residuals on the device.
#include "server/encode/device_predictor.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>

#include "kernels/finish_records.h"
#include "kernels/predict_phase.h"
#include "kernels/predict_small_phases.h"
#include "kernels/quantise_slots.h"
#include "kernels/sum_products.h"
#include "server/encode/residual_words.h"

namespace clothstream::encode {
namespace {

using codec::hierarchical::FitSchedule;
using codec::hierarchical::Phase;
using codec::hierarchical::Weights;
using vulkan::Buffer;
using vulkan::BufferPurpose;

using Row = std::array<std::uint32_t, 4>;

// Largest phase that one workgroup handles. Larger phases have their own dispatch.
constexpr std::uint32_t kSmallPhase = 512;
constexpr std::uint32_t kWorkgroupSize = 64;

// Invocations that handle a small phase in two rounds, if the device allows as many.
std::uint32_t smallPhasesWorkgroupSize(const vulkan::Device& device) {
  return std::min(
      {kSmallPhase / 2, device.limits().maxWorkgroupInvocations, device.limits().maxWorkgroupSizeX});
}

constexpr std::size_t momentBytes(std::size_t vertices) {
  return (vertices + 1 + shared::kRecordRows * vertices) * sizeof(Row);
}

void store(const Weights& weights, std::span<std::int32_t> to) {
  auto next = to.begin();
  for (std::size_t c = 0; c < codec::hierarchical::kWeightClasses; ++c)
    next = std::copy(weights[c].begin(), weights[c].end(), next);
}

static_assert(shared::kClasses == codec::hierarchical::kWeightClasses &&
              shared::kClassFeatures == codec::hierarchical::kFeatures &&
              shared::kFeatureProducts == codec::hierarchical::kProducts &&
              shared::kChunkSlots == codec::hierarchical::kChunk &&
              shared::kMaxMagnitude == codec::hierarchical::kMaxMagnitude &&
              shared::kMaxStillFrames == codec::hierarchical::kStillFrames &&
              shared::kRestsInTurn == codec::hierarchical::kRestsAtOnce);

codec::hierarchical::Hierarchy hierarchyOf(const vulkan::Device& device, const codec::StreamLayout& layout) {
  if (!DevicePredictor::supports(device, layout))
    throw std::runtime_error("frames with very many vertices are predicted on the host");
  codec::hierarchical::Hierarchy hierarchy;
  if (!hierarchy.build(layout)) throw std::bad_alloc();
  return hierarchy;
}

// Push constants with the numbers that are the same in each frame.
shared::PredictPush pushOf(const codec::StreamLayout& layout) {
  const codec::hierarchical::LatticeUnit unit = codec::hierarchical::latticeUnit(layout.maxError);
  int exponent;
  const double mantissa = std::frexp(codec::hierarchical::quantisationScale(unit.unit), &exponent);
  return {
      .vertexCount = layout.vertexCount(),
      .sinceKey = 0,
      .stepBits = static_cast<std::uint32_t>(unit.stepBits),
      .hasWeights = 0,
      .scale = static_cast<std::uint32_t>(std::ldexp(mantissa, codec::hierarchical::kScaleBits)),
      .scaleShift = static_cast<std::uint32_t>(codec::hierarchical::kScaleBits - exponent),
      .firstPhase = 0,
      .endPhase = 0,
  };
}

}  // namespace

bool DevicePredictor::supports(const vulkan::Device& device, const codec::StreamLayout& layout) {
  const vulkan::Limits& limits = device.limits();
  return momentBytes(layout.vertexCount()) <= limits.maxStorageRange &&
         layout.vertexCount() <= std::uint64_t{limits.maxDispatchX} * kWorkgroupSize;
}

DevicePredictor::DevicePredictor(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                                 const codec::StreamLayout& layout)
    : simulation_(simulation),
      hierarchy_(hierarchyOf(device, layout)),
      tables_(device, hierarchy_),
      moments_{Buffer(device, BufferPurpose::state, momentBytes(layout.vertexCount())),
               Buffer(device, BufferPurpose::state, momentBytes(layout.vertexCount()))},
      wanted_(device, BufferPurpose::state, layout.vertexCount() * sizeof(Row)),
      sentNormals_(device, BufferPurpose::state, layout.vertexCount() * sizeof(std::uint32_t)),
      status_(device, BufferPurpose::state, sizeof(shared::SlotStatus)),
      weights_(device, BufferPurpose::state, shared::kAllWeights * sizeof(std::int32_t)),
      push_(pushOf(layout)) {
  makeSlots(device);
  makeBindings(device);
  if (layout.normals == codec::NormalMode::octahedral)
    normals_.emplace(device, layout, hierarchy_, simulation.normals(), moments_, sentNormals_);
}

void DevicePredictor::makeSlots(const vulkan::Device& device) {
  const std::size_t n = push_.vertexCount;
  for (Slot& slot : slots_) {
    slot.status = Buffer(device, BufferPurpose::readback, sizeof(shared::SlotStatus));
    slot.residuals =
        Buffer(device, BufferPurpose::readback, shared::kResidualRows * n * sizeof(std::uint32_t));
    slot.wideResiduals = Buffer(device, BufferPurpose::readback, 3 * n * sizeof(std::int32_t));
    slot.products = Buffer(device, BufferPurpose::readback,
                           FitSchedule::kMaxChunks * sizeof(codec::hierarchical::ChunkProducts));
    slot.weights = Buffer(device, BufferPurpose::upload, 2 * shared::kClassWeights * sizeof(std::int32_t));
    slot.chunks = Buffer(device, BufferPurpose::upload, FitSchedule::kMaxChunks * sizeof(Row));
  }
}

void DevicePredictor::makeSteps(std::uint32_t smallPhasesWorkgroup) {
  const codec::Array<Phase>& phases = hierarchy_.phases;
  for (std::uint32_t i = 0; i < phases.size(); ++i) {
    const std::uint32_t size = phases[i].end - phases[i].begin;
    const bool isSmall = size <= kSmallPhase;
    if (isSmall && !steps_.empty() && steps_.back().isSmall)
      steps_.back().endPhase = i + 1;
    else
      steps_.push_back({i, i + 1, isSmall ? smallPhasesWorkgroup : size, isSmall});
  }
}

void DevicePredictor::makeBindings(const vulkan::Device& device) {
  const vulkan::Kernel quantise(device, kernels::quantise_slots, kWorkgroupSize);
  const vulkan::Kernel phase(device, kernels::predict_phase, kWorkgroupSize);
  const vulkan::Kernel smallPhases(device, kernels::predict_small_phases, smallPhasesWorkgroupSize(device));
  const vulkan::Kernel sum(device, kernels::sum_products, kWorkgroupSize);
  const vulkan::Kernel finish(device, kernels::finish_records, kWorkgroupSize);
  makeSteps(smallPhases.workgroupSize());
  for (std::uint32_t positions = 0; positions < 2; ++positions) {
    for (const Buffer& past : moments_) {
      quantiseBindings_.emplace_back(
          device, quantise,
          std::initializer_list<const Buffer*>{&simulation_.positions(positions), &tables_.slots(), &past,
                                               &wanted_, &status_});
    }
  }
  for (std::uint32_t referenceIndex = 0; referenceIndex < 2; ++referenceIndex) {
    const Buffer &past = moments_[referenceIndex], &made = moments_[1 - referenceIndex];
    for (const Slot& slot : slots_) {
      for (const bool isSmall : {false, true}) {
        (isSmall ? smallPhaseBindings_ : phaseBindings_)
            .emplace_back(device, isSmall ? smallPhases : phase,
                          std::initializer_list<const Buffer*>{
                              &tables_.links(), &past, &made, &wanted_, &status_, &weights_, &tables_.slots(),
                              &tables_.model(), &slot.residuals, &slot.wideResiduals});
      }
      sumBindings_.emplace_back(
          device, sum,
          std::initializer_list<const Buffer*>{&tables_.links(), &past, &made, &wanted_, &status_, &weights_,
                                               &tables_.slots(), &slot.chunks, &slot.products});
    }
    finishBindings_.emplace_back(
        device, finish,
        std::initializer_list<const Buffer*>{&tables_.links(), &past, &made, &tables_.slots(), &status_,
                                             &weights_, &sentNormals_});
  }
}

void DevicePredictor::recordTables(vulkan::Recorder& recorder) const {
  tables_.recordUpload(recorder);
  recorder.fill(wanted_, 0, wanted_.bytes());
  recorder.fill(sentNormals_, 0, sentNormals_.bytes());
  if (normals_) normals_->recordTables(recorder);
  // The origin follows the last node.
  for (const Buffer& moment : moments_)
    recorder.fill(moment, 0, sizeof(Row), push_.vertexCount * sizeof(Row));
}

void DevicePredictor::record(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t sinceKey,
                             const FrameWeights* weights, std::span<const Phase> chunks) {
  if (!started_) recordTables(recorder);
  started_ = true;
  const Slot& to = slots_[slot];
  push_.sinceKey = sinceKey;
  push_.hasWeights = weights != nullptr ? 1 : 0;
  recorder.fill(status_, 0, status_.bytes());
  if (weights != nullptr) {
    const std::span<std::int32_t> brought = to.weights.mapped<std::int32_t>();
    store(*weights->used, brought);
    store(*weights->left, brought.subspan(shared::kClassWeights));
    recorder.copy(to.weights, weights_, to.weights.bytes(), 0, shared::kSentWeights * sizeof(std::int32_t));
  }
  auto chunk = to.chunks.mapped<Row>().begin();
  for (const Phase& fitted : chunks) *chunk++ = {fitted.begin, fitted.end, fitted.weightClass, 0};

  const std::uint32_t referenceIndex = referenceIndex_;
  recorder.barrier();
  recorder.dispatch(quantiseBindings_[2 * simulation_.presentIndex() + referenceIndex], push_,
                    push_.vertexCount);
  for (const Step& step : steps_) {
    recorder.barrier();
    push_.firstPhase = step.firstPhase;
    push_.endPhase = step.endPhase;
    const std::vector<vulkan::Bindings>& bindings = step.isSmall ? smallPhaseBindings_ : phaseBindings_;
    recorder.dispatch(bindings[kFrameSlots * referenceIndex + slot], push_, step.vertices);
  }
  recorder.barrier();
  recorder.dispatch(sumBindings_[kFrameSlots * referenceIndex + slot], push_, kWorkgroupSize * chunks.size());
  if (normals_) normals_->record(recorder, slot, 1 - referenceIndex, push_);
  recorder.barrier();  // the next kernel changes the weights
  recorder.dispatch(finishBindings_[referenceIndex], push_,
                    std::max(push_.vertexCount, shared::kClassWeights));
  recorder.barrier();
  recorder.copy(status_, to.status, status_.bytes());
  referenceIndex_ = 1 - referenceIndex;
}

const shared::SlotStatus& DevicePredictor::status(std::uint32_t slot) const {
  return slots_[slot].status.mapped<shared::SlotStatus>().front();
}

codec::hierarchical::ChunkProducts DevicePredictor::products(std::uint32_t slot, std::size_t chunk) const {
  return slots_[slot].products.mapped<codec::hierarchical::ChunkProducts>()[chunk];
}

std::span<const std::uint32_t> DevicePredictor::normalResiduals(std::uint32_t slot) const {
  return normals_ ? normals_->residuals(slot) : std::span<const std::uint32_t>();
}

bool DevicePredictor::read(std::uint32_t slot, std::uint32_t begin, std::uint32_t count,
                           codec::hierarchical::ChunkResiduals& out) const {
  const std::span<const std::uint32_t> words = slots_[slot].residuals.mapped<std::uint32_t>();
  const std::span<const std::int32_t> wide = slots_[slot].wideResiduals.mapped<std::int32_t>();
  return unpackResiduals({.first = words.subspan(begin, count),
                          .second = words.subspan(std::size_t{push_.vertexCount} + begin, count),
                          .wide = wide.subspan(std::size_t{3} * begin, std::size_t{3} * count)},
                         out);
}

}  // namespace clothstream::encode
