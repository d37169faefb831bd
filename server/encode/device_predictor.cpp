// SPDX-License-Identifier: MIT
// Prediction and choice of residuals on the device.
#include "server/encode/device_predictor.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <new>
#include <stdexcept>

#include "kernels/finish_records.h"
#include "kernels/predict_normals.h"
#include "kernels/predict_phase.h"
#include "kernels/predict_small_phases.h"
#include "kernels/quantise_slots.h"
#include "kernels/sum_products.h"
#include "proto/codec/hierarchical/residual_model.h"
#include "server/encode/normal_tables.h"

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

// One word for each number of the model.
constexpr std::size_t kScaleWords = sizeof codec::hierarchical::kScaleWeights / sizeof(std::int16_t);

constexpr std::size_t momentBytes(std::size_t vertices) {
  return (vertices + 1 + shared::kRecordRows * vertices) * sizeof(Row);
}

// Packs ten bits each; the weights are within twice a whole.
constexpr std::uint32_t packed(const std::array<std::int16_t, 4>& parentWeights) {
  std::uint32_t word = 0;
  for (std::size_t i = 1; i < 4; ++i)
    word |= (static_cast<std::uint32_t>(parentWeights[i]) & 1023u) << 10 * (i - 1);
  return word;
}
static_assert(packed(codec::hierarchical::kEqualWeights) == shared::kEqualParentWeights);

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

}  // namespace

bool DevicePredictor::supports(const vulkan::Device& device, const codec::StreamLayout& layout) {
  const vulkan::Limits& limits = device.limits();
  return momentBytes(layout.vertexCount()) <= limits.maxStorageRange &&
         layout.vertexCount() <= std::uint64_t{limits.maxDispatchX} * kWorkgroupSize;
}

DevicePredictor::DevicePredictor(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                                 const codec::StreamLayout& layout)
    : simulation_(simulation),
      vertices_(layout.vertexCount()),
      hasNormals_(layout.normals == codec::NormalMode::octahedral),
      unit_(codec::hierarchical::latticeUnit(layout.maxError)),
      quantise_(device, kernels::quantise_slots, kWorkgroupSize),
      predictPhase_(device, kernels::predict_phase, kWorkgroupSize),
      predictSmallPhases_(device, kernels::predict_small_phases, smallPhasesWorkgroupSize(device)),
      sumProducts_(device, kernels::sum_products, kWorkgroupSize),
      predictNormals_(device, kernels::predict_normals, kWorkgroupSize),
      finish_(device, kernels::finish_records, kWorkgroupSize) {
  if (!supports(device, layout))
    throw std::runtime_error("frames with very many vertices are predicted on the host");
  if (!hierarchy_.build(layout)) throw std::bad_alloc();
  const std::size_t n = vertices_, phases = hierarchy_.phases.size();
  const auto table = [&](Buffer& buffer, Buffer& upload, std::size_t bytes) {
    buffer = Buffer(device, BufferPurpose::state, bytes);
    upload = Buffer(device, BufferPurpose::upload, bytes);
  };
  table(links_, linksUpload_, shared::kLinkRows * n * sizeof(Row));
  table(slotTable_, slotTableUpload_, 2 * n * sizeof(std::uint32_t));
  table(model_, modelUpload_, kScaleWords * sizeof(std::uint32_t) + phases * sizeof(Row));
  for (Buffer& moment : moments_) moment = Buffer(device, BufferPurpose::state, momentBytes(n));
  wanted_ = Buffer(device, BufferPurpose::state, n * sizeof(Row));
  sentNormals_ = Buffer(device, BufferPurpose::state, n * sizeof(std::uint32_t));
  status_ = Buffer(device, BufferPurpose::state, sizeof(shared::SlotStatus));
  weights_ = Buffer(device, BufferPurpose::state, shared::kAllWeights * sizeof(std::int32_t));
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
  makeSteps();
  makeBindings(device);
  if (hasNormals_) makeNormals(device, layout);

  push_.vertexCount = vertices_;
  push_.stepBits = static_cast<std::uint32_t>(unit_.stepBits);
  int exponent;
  const double mantissa = std::frexp(codec::hierarchical::quantisationScale(unit_.unit), &exponent);
  push_.scale = static_cast<std::uint32_t>(std::ldexp(mantissa, codec::hierarchical::kScaleBits));
  push_.scaleShift = static_cast<std::uint32_t>(codec::hierarchical::kScaleBits - exponent);
}

void DevicePredictor::makeNormals(const vulkan::Device& device, const codec::StreamLayout& layout) {
  const NormalTables tables = makeNormalTables(layout, hierarchy_);
  const auto fill = [&](const auto& table, Buffer& buffer, Buffer& upload) {
    // The table is never empty, although there may be no face.
    const std::size_t bytes = std::max(std::span(table).size_bytes(), sizeof(Row));
    buffer = Buffer(device, BufferPurpose::state, bytes);
    upload = Buffer(device, BufferPurpose::upload, bytes);
    std::ranges::copy(std::as_bytes(std::span(table)), upload.mapped().begin());
  };
  fill(tables.faces, faces_, facesUpload_);
  fill(tables.facesOf, facesOf_, facesOfUpload_);
  for (Slot& slot : slots_)
    slot.normalResiduals = Buffer(device, BufferPurpose::readback, vertices_ * sizeof(std::uint32_t));
  for (std::uint32_t referenceIndex = 0; referenceIndex < 2; ++referenceIndex) {
    for (const Slot& slot : slots_) {
      normalBindings_.emplace_back(
          device, predictNormals_,
          std::initializer_list<const Buffer*>{&simulation_.normals(), &moments_[1 - referenceIndex], &faces_,
                                               &facesOf_, &sentNormals_, &slot.normalResiduals});
    }
  }
}

void DevicePredictor::makeSteps() {
  const codec::Array<Phase>& phases = hierarchy_.phases;
  for (std::uint32_t i = 0; i < phases.size(); ++i) {
    const std::uint32_t size = phases[i].end - phases[i].begin;
    const bool isSmall = size <= kSmallPhase;
    if (isSmall && !steps_.empty() && steps_.back().isSmall)
      steps_.back().endPhase = i + 1;
    else
      steps_.push_back({i, i + 1, isSmall ? predictSmallPhases_.workgroupSize() : size, isSmall});
  }
}

void DevicePredictor::makeBindings(const vulkan::Device& device) {
  for (std::uint32_t positions = 0; positions < 2; ++positions) {
    for (const Buffer& past : moments_) {
      quantiseBindings_.emplace_back(
          device, quantise_,
          std::initializer_list<const Buffer*>{&simulation_.positions(positions), &slotTable_, &past,
                                               &wanted_, &status_});
    }
  }
  for (std::uint32_t referenceIndex = 0; referenceIndex < 2; ++referenceIndex) {
    const Buffer &past = moments_[referenceIndex], &made = moments_[1 - referenceIndex];
    for (const Slot& slot : slots_) {
      for (const bool isSmall : {false, true}) {
        (isSmall ? smallPhaseBindings_ : phaseBindings_)
            .emplace_back(device, isSmall ? predictSmallPhases_ : predictPhase_,
                          std::initializer_list<const Buffer*>{&links_, &past, &made, &wanted_, &status_,
                                                               &weights_, &slotTable_, &model_,
                                                               &slot.residuals, &slot.wideResiduals});
      }
      sumBindings_.emplace_back(
          device, sumProducts_,
          std::initializer_list<const Buffer*>{&links_, &past, &made, &wanted_, &status_, &weights_,
                                               &slotTable_, &slot.chunks, &slot.products});
    }
    finishBindings_.emplace_back(device, finish_,
                                 std::initializer_list<const Buffer*>{&links_, &past, &made, &slotTable_,
                                                                      &status_, &weights_, &sentNormals_});
  }
}

void DevicePredictor::uploadTables(vulkan::Recorder& recorder) {
  const std::span<std::uint32_t> links = linksUpload_.mapped<std::uint32_t>();
  for (std::size_t slot = 0; slot < vertices_; ++slot) {
    const auto row = [&](std::size_t at) {
      return links.begin() + static_cast<std::ptrdiff_t>(4 * (at * vertices_ + slot));
    };
    const codec::hierarchical::Neighbours& neighbours = hierarchy_.neighbours[slot];
    std::copy_n(neighbours.parents.begin(), 4, row(shared::kLinkParents));
    std::copy_n(neighbours.ring.begin(), 4, row(shared::kLinkRing));
    std::copy_n(neighbours.ring.begin() + 4, 4, row(shared::kLinkRing + 1));
    std::copy_n(hierarchy_.nearest[slot].begin(), 4, row(shared::kLinkNearest));
  }
  auto next =
      std::copy_n(hierarchy_.vertexOf.data(), vertices_, slotTableUpload_.mapped<std::uint32_t>().begin());
  for (const codec::hierarchical::Neighbours& neighbours : hierarchy_.neighbours)
    *next++ = packed(neighbours.weights);
  auto model = modelUpload_.mapped<std::uint32_t>().begin();
  for (const auto& ofClass : codec::hierarchical::kScaleWeights) {
    for (const codec::hierarchical::ScaleWeights& w : ofClass) {
      for (const std::int16_t weight : {w.parents, w.ring, w.last, w.normal, w.u, w.constant})
        *model++ = static_cast<std::uint32_t>(std::int32_t{weight});
    }
  }
  for (const Phase& phase : hierarchy_.phases)
    model = std::ranges::copy(Row{phase.begin, phase.end, phase.weightClass, 0}, model).out;
  recorder.copy(linksUpload_, links_, links_.bytes());
  recorder.copy(slotTableUpload_, slotTable_, slotTable_.bytes());
  recorder.copy(modelUpload_, model_, model_.bytes());
  recorder.fill(wanted_, 0, wanted_.bytes());
  recorder.fill(sentNormals_, 0, sentNormals_.bytes());
  if (hasNormals_) {
    recorder.copy(facesUpload_, faces_, faces_.bytes());
    recorder.copy(facesOfUpload_, facesOf_, facesOf_.bytes());
  }
  // The origin follows the last node.
  for (const Buffer& moment : moments_) recorder.fill(moment, 0, sizeof(Row), vertices_ * sizeof(Row));
}

void DevicePredictor::record(vulkan::Recorder& recorder, std::uint32_t slot, std::uint32_t sinceKey,
                             const FrameWeights* weights, std::span<const Phase> chunks) {
  if (!started_) uploadTables(recorder);
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
  recorder.dispatch(quantiseBindings_[2 * simulation_.presentIndex() + referenceIndex], push_, vertices_);
  for (const Step& step : steps_) {
    recorder.barrier();
    push_.firstPhase = step.firstPhase;
    push_.endPhase = step.endPhase;
    const std::vector<vulkan::Bindings>& bindings = step.isSmall ? smallPhaseBindings_ : phaseBindings_;
    recorder.dispatch(bindings[kFrameSlots * referenceIndex + slot], push_, step.vertices);
  }
  recorder.barrier();
  recorder.dispatch(sumBindings_[kFrameSlots * referenceIndex + slot], push_, kWorkgroupSize * chunks.size());
  if (hasNormals_) recorder.dispatch(normalBindings_[kFrameSlots * referenceIndex + slot], push_, vertices_);
  recorder.barrier();  // the next kernel changes the weights
  recorder.dispatch(finishBindings_[referenceIndex], push_, std::max(vertices_, shared::kClassWeights));
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
  return slots_[slot].normalResiduals.mapped<std::uint32_t>();
}

bool DevicePredictor::read(std::uint32_t slot, std::uint32_t begin, std::uint32_t count,
                           codec::hierarchical::ChunkResiduals& out) const {
  using namespace codec::hierarchical;
  const std::span<const std::uint32_t> words = slots_[slot].residuals.mapped<std::uint32_t>();
  const std::uint32_t *along = &words[begin], *across = &words[std::size_t{vertices_} + begin];
  std::uint32_t all = 0, special = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t a = along[i], b = across[i];
    out.residuals[kAlongU][i] = static_cast<std::int16_t>(a);
    out.residuals[kAlongV][i] = static_cast<std::int32_t>(a) >> 16;
    out.residuals[kAlongNormal][i] = static_cast<std::int16_t>(b);
    out.scales[kAlongU][i] = static_cast<std::int32_t>(b >> 16 & 31u);
    out.scales[kAlongV][i] = static_cast<std::int32_t>(b >> 21 & 31u);
    out.scales[kAlongNormal][i] = static_cast<std::int32_t>(b >> 26 & 31u);
    all |= a | (b & (shared::kSpecialWord | 0xffffu));
    special |= b;
  }
  out.anyStays = false;
  if ((special & shared::kSpecialWord) == 0) return all != 0;
  const std::span<const std::int32_t> wide = slots_[slot].wideResiduals.mapped<std::int32_t>();
  for (std::uint32_t i = 0; i < count; ++i) {
    const bool isSpecial = (across[i] & shared::kSpecialWord) != 0;
    const bool isWide = isSpecial && (along[i] | (across[i] & 0xffffu)) != 0;
    out.stays[i] = isSpecial && !isWide;
    out.anyStays = out.anyStays || out.stays[i];
    for (std::size_t c = 0; isWide && c < kComponents; ++c)
      out.residuals[c][i] = wide[kComponents * (std::size_t{begin} + i) + c];
  }
  return true;
}

}  // namespace clothstream::encode
