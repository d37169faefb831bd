// SPDX-License-Identifier: MIT
// Codec 2: packets to vertices.
#include <algorithm>
#include <cstring>
#include <new>

#include "proto/codec/body.h"
#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/rans.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

// Not 0 where a coordinate is beyond kMaxCoordinate.
std::uint32_t isOutside(Int32x4 position) {
  alignas(16) std::int32_t p[4];
  position.store(p);
  std::uint32_t outside = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    outside |= static_cast<std::uint32_t>(p[c]) + kMaxCoordinate > 2u * kMaxCoordinate ? 1u : 0u;
  }
  return outside;
}

class HierarchicalDecoder final : public BodyDecoder {
 public:
  bool allocate(const StreamLayout& layout) {
    unit_ = latticeUnit(layout.maxError);
    return predictor_.allocate(layout, unit_.stepBits);
  }

  bool decode(const ParsedPacket& packet) override;
  void writePositions(float* out) const override;
  void writeNormals(float*) const override {}
  std::uint64_t reconstructionHash() const override;

 private:
  struct Streams {
    RansReader symbols;
    BitReader bits;
  };

  bool readWeights(std::span<const std::byte> section, bool key, Weights& weights, bool& atRest) const;
  // Without a model there are no residuals. Returns whether a position lies outside.
  std::uint32_t decodeChunk(std::uint32_t begin, std::uint32_t end, const FeatureVectors& weights,
                            const ScaleModel* model, Streams& streams);
  // The residuals of up to kCoders vertices, from predictions_[first] on.
  void setStaying(std::size_t i) {
    stays_[i] = true;
    for (std::size_t c = 0; c < kComponents; ++c) {
      residuals_[i][c] = 0;
      magnitudes_[i][c] = 0;
    }
  }
  template <typename Count>
  void readResiduals(std::size_t first, Count count, const ScaleModel& model, Streams& streams);

  LatticeUnit unit_{};
  Predictor predictor_;
  Weights weights_{};
  // Of the chunk that is being decoded.
  std::array<Prediction, kChunk> predictions_;
  alignas(16) std::int32_t expected_[kChunk][4];
  std::int32_t residuals_[kChunk][kComponents];
  std::uint32_t magnitudes_[kChunk][kComponents];
  std::array<bool, kChunk> stays_;
};

bool HierarchicalDecoder::readWeights(std::span<const std::byte> section, bool key, Weights& weights,
                                      bool& atRest) const {
  atRest = false;
  if (section.empty()) return true;
  BitReader reader(section);
  atRest = reader.get(1) != 0;
  for (std::size_t c = 0; !atRest && c < kWeightClasses; ++c) {
    if (reader.get(1) == 0) continue;
    for (std::size_t f = firstWeight(key); f < endWeight(key); ++f) {
      const std::int64_t value = std::int64_t{weights[c][f]} + unzigzag(reader.getGamma(kWeightGammaBits));
      if (value < -kMaxWeight || value > kMaxWeight) return false;
      weights[c][f] = static_cast<std::int16_t>(value);
    }
  }
  return reader.atEnd();
}

bool HierarchicalDecoder::decode(const ParsedPacket& packet) {
  const PacketHeader& header = packet.header;
  if (header.sectionCount != kSections) return false;
  const bool key = header.kind == PacketKind::key;
  const std::size_t weightBytes = header.sectionBytes[0], symbolBytes = header.sectionBytes[1];
  Weights weights = key ? keyFrameWeights() : weights_;
  bool atRest;
  if (!readWeights(packet.body.first(weightBytes), key, weights, atRest)) return false;
  const WeightVectors vectors = weightVectors(atRest ? Weights{} : weights);
  Streams streams{RansReader(packet.body.subspan(weightBytes, symbolBytes)),
                  BitReader(packet.body.subspan(weightBytes + symbolBytes))};
  std::uint32_t outside = 0;
  predictor_.begin(key);
  for (const Phase& phase : predictor_.hierarchy().phases) {
    const ScaleModel model(kScaleWeights[phase.weightClass / 2]);
    const bool quiet = streams.bits.get(1) != 0;
    for (std::uint32_t begin = phase.begin; begin < phase.end; begin += kChunk) {
      const std::uint32_t end = std::min(begin + kChunk, phase.end);
      outside |= decodeChunk(begin, end, vectors[phase.weightClass], quiet ? nullptr : &model, streams);
    }
  }
  if (outside != 0 || !streams.symbols.atEnd() || !streams.bits.atEnd()) return false;
  predictor_.keep();
  weights_ = key ? startingWeights() : weights;
  return true;
}

std::uint32_t HierarchicalDecoder::decodeChunk(std::uint32_t begin, std::uint32_t end,
                                               const FeatureVectors& weights, const ScaleModel* model,
                                               Streams& streams) {
  const std::size_t count = end - begin;
  for (std::size_t i = 0; i < count; ++i) {
    predictor_.predict(begin + static_cast<std::uint32_t>(i), weights, predictions_[i]);
    if (model != nullptr) model->expect(predictions_[i]).store(expected_[i]);
  }
  if (model != nullptr) {
    std::size_t first = 0;
    for (; first + kCoders <= count; first += kCoders) {
      readResiduals(first, std::integral_constant<std::size_t, kCoders>(), *model, streams);
    }
    readResiduals(first, count - first, *model, streams);
  } else {
    std::memset(residuals_, 0, sizeof residuals_);
    std::memset(magnitudes_, 0, sizeof magnitudes_);
    stays_.fill(false);
  }
  std::uint32_t outside = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Int32x4 position =
        stays_[i] ? predictions_[i].last : predictor_.reconstruct(predictions_[i], residuals_[i]);
    outside |= isOutside(position);
    predictor_.place(begin + static_cast<std::uint32_t>(i), predictions_[i], position,
                     packMagnitudes(magnitudes_[i]));
  }
  return outside;
}

template <typename Count>
void HierarchicalDecoder::readResiduals(std::size_t first, Count count, const ScaleModel& model,
                                        Streams& streams) {
  const auto& tables = symbolTables();
  for (const Component component : kCodingOrder) {
    for (std::size_t coder = 0; coder < count; ++coder) {
      const std::size_t i = first + coder;
      if (component == kAlongNormal) stays_[i] = false;
      if (stays_[i]) continue;
      const std::uint32_t scale = model.scale(component, expected_[i][component], magnitudes_[i]);
      std::uint32_t number = streams.symbols.read(coder, tables[distributionOf(component, scale)]);
      if (number == kEscape) {
        const std::uint32_t beyond = streams.bits.getGamma(kEscapeGammaBits);
        if (component == kAlongNormal) {
          if (beyond == kStays) {
            setStaying(i);
            continue;
          }
          number -= 1;
        }
        number += beyond;
      }
      if (const unsigned raw = rawBits(scale); raw > 0) number = number << raw | streams.bits.get(raw);
      residuals_[i][component] = unzigzag(number);
      magnitudes_[i][component] = countedMagnitude(residuals_[i][component]);
    }
  }
}

void HierarchicalDecoder::writePositions(float* out) const {
  const Array<std::uint32_t>& vertexOf = predictor_.hierarchy().vertexOf;
  const std::span<const Node> nodes = predictor_.nodes();
  for (std::size_t slot = 0; slot < nodes.size(); ++slot) {
    float* position = out + 3 * std::size_t{vertexOf[slot]};
    position[0] = static_cast<float>(nodes[slot].x) * unit_.unit;
    position[1] = static_cast<float>(nodes[slot].y) * unit_.unit;
    position[2] = static_cast<float>(nodes[slot].z) * unit_.unit;
  }
}

std::uint64_t HierarchicalDecoder::reconstructionHash() const {
  return hashNodes(predictor_);
}

}  // namespace
}  // namespace clothstream::codec::hierarchical

namespace clothstream::codec {

std::unique_ptr<BodyDecoder> makeHierarchicalDecoder(const StreamLayout& layout) {
  using hierarchical::HierarchicalDecoder;
  std::unique_ptr<HierarchicalDecoder> decoder(new (std::nothrow) HierarchicalDecoder);
  if (decoder == nullptr || !decoder->allocate(layout)) return nullptr;
  return decoder;
}

}  // namespace clothstream::codec
