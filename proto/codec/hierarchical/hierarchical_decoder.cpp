// SPDX-License-Identifier: MIT
// Decoder of codec 2.
#include "proto/codec/hierarchical/hierarchical_decoder.h"

#include <algorithm>
#include <utility>

#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

Int32x4 unzigzagLanes(Int32x4 numbers) {
  return numbers.bitsShiftedRight(1) ^ (Int32x4::all(0) - (numbers & Int32x4::all(1)));
}

// Applies the changes that a frame carries to `weights`.
bool readWeights(std::span<const std::byte> section, bool key, Weights& weights, bool& atRest) {
  atRest = false;
  if (section.empty()) return true;
  BitReader reader(section);
  atRest = reader.get(1) != 0;
  if (atRest) return reader.atEnd();
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    if (reader.get(1) == 0) continue;
    for (std::size_t f = firstWeight(key); f < endWeight(key); ++f) {
      std::int16_t& weight = weights[c][f];
      const std::int64_t value = std::int64_t{weight} + codec::unzigzag(reader.getGamma(kWeightGammaBits));
      if (value < -kMaxWeight || value > kMaxWeight) return false;
      weight = static_cast<std::int16_t>(value);
    }
  }
  return reader.atEnd();
}

}  // namespace

bool HierarchicalDecoder::allocate(const StreamLayout& layout, Detail detail) {
  layout_ = layout;
  isCoarse_ = detail == Detail::coarse;
  hasNormals_ = layout.normals == NormalMode::octahedral;
  unit_ = latticeUnit(layout.maxError);
  if (hasNormals_ && !(normals_.allocate(layout.vertexCount()) &&
                       newNormals_.allocate(layout.vertexCount()) && normalPrediction_.allocate(layout)))
    return false;
  return predictor_.allocate(layout, unit_.stepBits);
}

bool HierarchicalDecoder::decode(const ParsedPacket& packet) {
  // A quality starts with a key frame. A refused key frame changes nothing.
  const LatticeUnit unit = latticeUnit(maxErrorOf(layout_, packet.header.quality));
  predictor_.setStepBits(unit.stepBits);
  if (!decodeFrame(packet)) {
    predictor_.setStepBits(unit_.stepBits);
    return false;
  }
  unit_ = unit;
  return true;
}

bool HierarchicalDecoder::decodeFrame(const ParsedPacket& packet) {
  const PacketHeader& header = packet.header;
  if (header.sectionCount != kSections) return false;
  const bool key = header.kind == PacketKind::key;
  const std::span<const std::byte> changes = packet.body.first(header.sectionBytes[kWeightChanges]);
  Weights weights = key ? keyFrameWeights() : weights_;
  bool atRest;
  if (!readWeights(changes, key, weights, atRest)) return false;
  const Vectors vectors = weightVectors(atRest ? Weights{} : weights);
  Streams streams = openStreams(packet);
  beyond_ = Int32x4::all(0);
  predictor_.begin(key);
  const Hierarchy& hierarchy = predictor_.hierarchy();
  decodePhases(0, hierarchy.coarsePhases, key, vectors, streams);
  if (!streams.isCoarseRead()) return false;
  if (isCoarse_) {
    if (isOutside()) return false;
    predictor_.interpolate(hierarchy.coarseVertices, static_cast<std::uint32_t>(hierarchy.vertexOf.size()));
    predictor_.keep(hierarchy.coarseVertices);
  } else {
    decodePhases(hierarchy.coarsePhases, hierarchy.phases.size(), key, vectors, streams);
    if (isOutside()) return false;
    if (hasNormals_) decodeNormals(streams);
    if (!streams.symbols.atEnd() || !streams.bits.atEnd()) return false;
    if (hasNormals_) std::swap(normals_, newNormals_);
    predictor_.keep();
  }
  weights_ = key ? startingWeights() : weights;
  return true;
}

HierarchicalDecoder::Streams HierarchicalDecoder::openStreams(const ParsedPacket& packet) const {
  const auto& bytes = packet.header.sectionBytes;
  const std::span<const std::byte> body = packet.body.subspan(bytes[kWeightChanges]);
  const std::size_t coarseSymbols = bytes[kCoarseSymbols], coarseBits = bytes[kCoarseBits],
                    symbols = coarseSymbols + bytes[kFineSymbols];
  return {RansReader(body.first(isCoarse_ ? coarseSymbols : symbols)),
          BitReader(isCoarse_ ? body.subspan(symbols, coarseBits) : body.subspan(symbols)), coarseSymbols,
          coarseBits};
}

void HierarchicalDecoder::decodePhases(std::size_t begin, std::size_t end, bool key, const Vectors& weights,
                                       Streams& streams) {
  for (std::size_t i = begin; i < end; ++i) {
    const Phase& phase = predictor_.hierarchy().phases[i];
    const ScaleModel model(kScaleWeights[scaleClassOf(phase.weightClass, key)]);
    const bool quiet = streams.bits.get(1) != 0;
    for (std::uint32_t first = phase.begin; first < phase.end; first += kChunk) {
      decodeChunk(first, std::min(kChunk, phase.end - first), weights[phase.weightClass],
                  quiet ? nullptr : &model, streams);
    }
  }
}

// Normals are the last symbols and bits of a packet.
void HierarchicalDecoder::decodeNormals(Streams& streams) {
  const std::span<const FacedNormal> predicted = normalPrediction_.predict(layout_, predictor_);
  std::array<NormalScale, 2> scales;
  for (std::size_t vertex = 0; vertex < predicted.size(); ++vertex) {
    std::array<std::int32_t, 2> residuals;
    for (std::size_t c = 0; c < 2; ++c) residuals[c] = readOfNormal(c, vertex, scales[c], streams);
    const FacedNormal& expected = predicted[vertex];
    const auto moved = [](std::int8_t from, std::int32_t by) {
      return static_cast<std::int8_t>(static_cast<std::uint32_t>(from) + static_cast<std::uint32_t>(by));
    };
    newNormals_[vertex] = {
        {moved(expected.octahedral.u, residuals[0]), moved(expected.octahedral.v, residuals[1])},
        expected.top};
  }
}

std::int32_t HierarchicalDecoder::readOfNormal(std::size_t component, std::size_t vertex, NormalScale& scale,
                                               Streams& streams) {
  const std::uint32_t s = scale.scale();
  std::uint32_t number = streams.symbols.read<false>((2 * vertex + component) % kCoders,
                                                     symbolTables()[distributionOf(kAlongU, s)]);
  if (number == kEscape) number += streams.bits.getGamma(kEscapeGammaBits);
  if (const unsigned raw = rawBits(s); raw > 0) number = number << raw | streams.bits.get(raw);
  const std::int32_t residual = codec::unzigzag(number);
  scale.add(residual);
  return residual;
}

void HierarchicalDecoder::decodeChunk(std::uint32_t begin, std::uint32_t count, const WeightVectors& weights,
                                      const ScaleModel* model, Streams& streams) {
  predictor_.predict(begin, count, weights, predictions_.data(), frames_.data());
  if (model != nullptr) {
    readResiduals(count, *model, streams);
    return reconstruct(begin, count);
  }
  for (std::uint32_t first = 0; first < count; first += 4) {
    const Prediction* four = &predictions_[first];
    place(begin + first, std::min(count - first, 4u), four,
          {four[0].position, four[1].position, four[2].position, four[3].position}, Int32x4::all(0));
  }
}

void HierarchicalDecoder::readResiduals(std::uint32_t count, const ScaleModel& model, Streams& streams) {
  stays_.fill(false);
  anyStays_ = false;
  std::array<Vectors4, kChunk / 4> expected;
  for (std::size_t i = 0; i < count; i += 4) expected[i / 4] = model.expect(&predictions_[i]);
  const auto counted = [&](Component component, std::size_t i) {
    return countedMagnitudes(Int32x4::load(&residuals_[component][i]));
  };
  const Int32x4 none = Int32x4::all(0);
  for (std::size_t i = 0; i < count; i += 4)
    model.scales(kAlongNormal, expected[i / 4].z, none, none).store(&scales_[i]);
  readComponent(kAlongNormal, count, streams);
  for (std::size_t i = 0; i < count; i += 4)
    model.scales(kAlongU, expected[i / 4].x, counted(kAlongNormal, i), none).store(&scales_[i]);
  readComponent(kAlongU, count, streams);
  for (std::size_t i = 0; i < count; i += 4) {
    model.scales(kAlongV, expected[i / 4].y, counted(kAlongNormal, i), counted(kAlongU, i))
        .store(&scales_[i]);
  }
  readComponent(kAlongV, count, streams);
}

void HierarchicalDecoder::readComponent(Component component, std::uint32_t count, Streams& streams) {
  if (streams.symbols.hasRoomFor(count + 1))
    readSymbols<true>(component, count, streams.symbols);
  else
    readSymbols<false>(component, count, streams.symbols);
  for (std::uint32_t first = 0; first < count; first += 4)
    completeResiduals(component, first, std::min(count - first, 4u), streams.bits);
}

// A vertex that stays has no symbol.
template <bool within>
void HierarchicalDecoder::readSymbols(Component component, std::uint32_t count, RansReader& reader) {
  const SymbolTable* tables = &symbolTables()[distributionOf(component, 0)];
  RansReader symbols = reader;  // keeps the states in registers
  std::int32_t* const out = residuals_[component];
  const auto read = [&](std::size_t i, std::size_t coder) {
    out[i] = static_cast<std::int32_t>(symbols.read<within>(coder, tables[scales_[i]]));
  };
  static_assert(kCoders == 4);
  for (std::size_t i = 0; i < count; i += kCoders) {
    if (i + kCoders <= count && !anyStays_) {
      read(i, 0);
      read(i + 1, 1);
      read(i + 2, 2);
      read(i + 3, 3);
      continue;
    }
    for (std::size_t coder = 0; coder < kCoders && i + coder < count; ++coder)
      if (!stays_[i + coder]) read(i + coder, coder);
  }
  reader = symbols;
}

// Completes residuals from their symbols and from the bits next to these.
void HierarchicalDecoder::completeResiduals(Component component, std::uint32_t first, std::uint32_t count,
                                            BitReader& bits) {
  std::int32_t* const residuals = &residuals_[component][first];
  const Int32x4 symbols = Int32x4::load(residuals);
  const Int32x4 scales = Int32x4::load(&scales_[first]);
  const Int32x4 isMore = (symbols == Int32x4::all(kEscape)) |
                         (scales > Int32x4::all(static_cast<std::int32_t>(kFirstScaleWithRawBits) - 1));
  if (isMore.signs() == 0 && !anyStays_) {
    unzigzagLanes(symbols).store(residuals);
    return;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    auto number = static_cast<std::uint32_t>(residuals[i]);
    if (!stays_[first + i] && number == kEscape) number = readEscaped(component, first + i, bits);
    if (stays_[first + i]) {
      residuals[i] = 0;
      continue;
    }
    if (const unsigned raw = rawBits(static_cast<std::uint32_t>(scales_[first + i])); raw > 0)
      number = number << raw | bits.get(raw);
    residuals[i] = codec::unzigzag(number);
  }
}

std::uint32_t HierarchicalDecoder::readEscaped(Component component, std::size_t i, BitReader& bits) {
  const std::uint32_t beyond = bits.getGamma(kEscapeGammaBits);
  if (component != kAlongNormal) return kEscape + beyond;
  if (beyond != kStays) return kEscape + beyond - 1;
  stays_[i] = anyStays_ = true;
  return 0;
}

void HierarchicalDecoder::reconstruct(std::uint32_t begin, std::uint32_t count) {
  for (std::uint32_t first = 0; first < count; first += 4) {
    const Vectors4 r{Int32x4::load(&residuals_[kAlongU][first]), Int32x4::load(&residuals_[kAlongV][first]),
                     Int32x4::load(&residuals_[kAlongNormal][first])};
    const Prediction* four = &predictions_[first];
    std::array<Int32x4, 4> positions = transposed(predictor_.moved(frames_[first / 4], r));
    for (std::size_t i = 0; i < 4; ++i) positions[i] = positions[i] + four[i].position;
    const int far = beyond16Bits(r).signs();
    const std::uint32_t those = std::min(count - first, 4u);
    for (std::size_t i = 0; (far != 0 || anyStays_) && i < those; ++i) {
      if (anyStays_ && stays_[first + i]) positions[i] = four[i].last;
      if ((far >> i & 1) == 0) continue;
      const std::int32_t residual[]{residuals_[kAlongU][first + i], residuals_[kAlongV][first + i],
                                    residuals_[kAlongNormal][first + i]};
      positions[i] = predictor_.reconstruct(four[i], residual);
    }
    place(begin + first, those, four, positions,
          packMagnitudes(countedMagnitudes(r.x), countedMagnitudes(r.y), countedMagnitudes(r.z)));
  }
}

void HierarchicalDecoder::place(std::uint32_t begin, std::uint32_t count, const Prediction* predictions,
                                const std::array<Int32x4, 4>& positions, Int32x4 magnitudes) {
  const Int32x4 limit = Int32x4::all(kMaxCoordinate);
  for (std::uint32_t i = 0; i < count; ++i) beyond_ = beyond_ | (positions[i].magnitude() > limit);
  predictor_.place(begin, count, predictions, positions, magnitudes);
}

void HierarchicalDecoder::writePositions(float* out) const {
  const Array<std::uint32_t>& vertexOf = predictor_.hierarchy().vertexOf;
  const std::span<const Node> nodes = predictor_.nodes();
  const Float32x4 unit = Float32x4::all(unit_.unit);
  const auto& [x, y, z] = layout_.origin;
  const Float32x4 origin = Float32x4::of(x, y, z, 0);
  for (std::size_t slot = 0; slot < nodes.size(); ++slot)
    (Float32x4::of(nodes[slot].load()) * unit + origin).storeThree(out + 3 * std::size_t{vertexOf[slot]});
}

std::uint64_t HierarchicalDecoder::reconstructionHash() const {
  return hashNodes(predictor_, {normals_.data(), normals_.size()});
}

void HierarchicalDecoder::writeNormals(float* out) const {
  for (std::size_t vertex = 0; vertex < normals_.size(); ++vertex)
    unfaceNormal(normals_[vertex], out + 3 * vertex);
}

}  // namespace clothstream::codec::hierarchical
