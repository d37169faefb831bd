// SPDX-License-Identifier: MIT
// Codec 2: vertices to packets.
#include "proto/codec/hierarchical/hierarchical_encoder.h"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "proto/codec/hierarchical/bits.h"
#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/rans.h"
#include "proto/codec/hierarchical/weight_fitter.h"
#include "proto/codec/zigzag.h"

namespace clothstream::codec::hierarchical {
namespace {

// The weights are fitted and sent once in so many frames, and in each of the first after a key frame.
constexpr std::uint32_t kWeightInterval = 4, kEagerFrames = 3;
// Vertices of each weight class that are fitted to: one in so many.
constexpr std::array<std::uint32_t, kWeightClasses> kFitStride{6, 6, 2, 2, 1, 1};

// What so few vertices would gain is less than what their weights take.
constexpr std::uint32_t kFewVertices = 100;

constexpr std::uint8_t kStillFrames = 3;
constexpr std::uint32_t kMostRests = 64;

constexpr std::size_t kMaxWeightBytes = kMaxTemporalLayers * kWeightClasses * kFeatures * 4;
// Of an escape and what stands beside it, at most.
constexpr std::size_t kMaxExtraBytes = 8;

// Along u, v and n, in steps: of one vertex, and of four.
struct Local {
  float u, v, n;
};
struct Local4 {
  Float32x4 u, v, n;
};

double squaredLength(Int32x4 difference) {
  alignas(16) std::int32_t d[4];
  difference.store(d);
  const double x = d[0], y = d[1], z = d[2];
  return x * x + y * y + z * z;
}

std::int32_t nearest(float value) {
  return simde_mm_cvtss_si32(simde_mm_set_ss(value));
}

}  // namespace

struct HierarchicalEncoder::State {
  explicit State(const StreamLayout& streamLayout)
      : layout(streamLayout),
        vertices(layout.vertexCount()),
        layers(layout.temporalLayers),
        hasNormals(layout.normals == NormalMode::octahedral),
        unit(latticeUnit(layout.maxError)),
        wanted(vertices),
        stillFrames(vertices),
        symbols((kComponents + (hasNormals ? 2 : 0)) * vertices),
        extra(((kComponents + (hasNormals ? 2 : 0)) * kMaxExtraBytes + 1) * vertices + kMaxExtraBytes),
        fitters(layers),
        sentNormals(hasNormals ? vertices : 0) {
    if (!predictor.allocate(layout, unit.stepBits) || (hasNormals && !normalPrediction.allocate(layout)))
      std::abort();  // memory is out, as of any other allocation here
    for (const Phase& phase : predictor.hierarchy().phases)
      classSizes[phase.weightClass] += phase.end - phase.begin;
    header.codec = kCodecHierarchical;
    header.epoch = layout.epoch;
    header.rangeCount = 1;
    header.ranges[0] = {0, static_cast<std::uint32_t>(layout.cloths.size())};
    header.sectionCount = kSections;
  }

  // Of the distance, in units: half a step along three axes, and a unit for roundings.
  double squaredPromise() const {
    const double perAxis = (1 << (unit.stepBits - 1)) + 1;
    return 3 * perAxis * perAxis;
  }
  void quantise(std::span<const float> positions);
  Local local(const SurfaceFrame& frame, Int32x4 difference) const;
  void choose(std::uint32_t begin, std::size_t first, std::array<Int32x4, 4>& positions);
  Int32x4 chooseFar(const Prediction& prediction, Int32x4 target, std::int32_t* residual) const;
  bool isAtRest() const;
  std::size_t writeWeights(const FrameRole& role, std::byte* out);
  void writeChanges(bool key, std::size_t of, BitWriter& writer);
  void use(const Weights& chosen);
  void attempt();
  void encodePhases(BitWriter& bits);
  bool startsToRest(std::uint32_t slot, const Prediction& prediction);
  bool goesOnResting(std::uint32_t slot, const Prediction& prediction) const;
  void encodePhase(const Phase& phase, BitWriter& bits);
  // Returns whether a residual is not 0.
  bool encodeChunk(std::uint32_t begin, std::uint32_t count, std::uint32_t weightClass, BitWriter& bits);
  void rest(std::uint32_t begin, std::size_t first, std::size_t count, std::array<Int32x4, 4>& positions);
  void codeChunk(std::size_t count, const ScaleModel& model, BitWriter& bits);
  void fitTo(std::uint32_t weightClass, const FeatureVectors& features, const Prediction& prediction,
             Int32x4 target, std::size_t i);
  void code(Component component, std::uint32_t scale, std::size_t i, std::size_t coder, BitWriter& bits);
  void encodeNormals(std::span<const float> normals, BitWriter& bits);
  void note(const Prediction& prediction, std::uint32_t weightClass, std::size_t i);

  StreamLayout layout;
  std::size_t vertices;
  std::uint8_t layers;
  bool hasNormals;
  LatticeUnit unit;
  Predictor predictor;
  std::array<std::uint32_t, kWeightClasses + 1> classSizes{};
  PacketHeader header;
  // In coding order.
  std::vector<Node> wanted;
  std::vector<std::uint8_t> stillFrames;  // how long the same was wanted, up to kStillFrames
  std::uint32_t restsLeft = 0;            // that may start in this frame
  RansWriter symbols;
  std::vector<std::byte> extra;
  // Of these, what coarse vertices take.
  std::size_t coarseSymbols = 0, coarseBytes = 0;
  std::vector<WeightFitter> fitters;                    // by layer
  std::array<LayerWeights, kMaxTemporalLayers> kept{};  // that the newest frame of each layer left
  LayerWeights weights{};                               // that this one leaves
  Weights used{};                                       // in this frame
  std::array<WeightVectors, kWeightClasses + 1> vectors{};
  std::uint32_t frame = 0;  // since the key frame
  std::uint8_t layer = 0;
  bool quiet = false;  // no residual in the newest frame
  NormalPrediction normalPrediction;
  std::vector<FacedNormal> sentNormals;  // by vertex
  std::vector<CodedResidual>* recorded = nullptr;
  // Of the chunk that is being encoded.
  std::array<Prediction, kChunk> predictions;
  std::array<SurfaceFrames, kChunk / 4> frames;
  // By component.
  alignas(16) std::int32_t residuals[kComponents][kChunk];
  alignas(16) std::int32_t magnitudes[kComponents][kChunk];
  std::array<bool, kChunk> stays{};
  std::uint32_t staying = 0;  // how many
};

void HierarchicalEncoder::State::quantise(std::span<const float> positions) {
  // A residual ends within a step of what was wanted, which is then still possible.
  constexpr std::int32_t kLimit = kMaxCoordinate - (4 << 8);
  constexpr double limit = kLimit;
  const Array<std::uint32_t>& vertexOf = predictor.hierarchy().vertexOf;
  const double perUnit = 1 / static_cast<double>(unit.unit);
  const auto coordinate = [&](float x) {
    const double q = static_cast<double>(x) * perUnit;
    if (!(q >= -limit)) return -kLimit;  // what is no number, too
    return q > limit ? kLimit : simde_mm_cvtsd_si32(simde_mm_set_sd(q));
  };
  for (std::size_t slot = 0; slot < vertices; ++slot) {
    const float* p = &positions[3 * std::size_t{vertexOf[slot]}];
    const Node next{coordinate(p[0]), coordinate(p[1]), coordinate(p[2]), 0};
    const bool still = next.load().sameThree(wanted[slot].load());
    stillFrames[slot] =
        still ? static_cast<std::uint8_t>(std::min<std::uint32_t>(stillFrames[slot] + 1u, kStillFrames)) : 0;
    wanted[slot] = next;
  }
}

// In steps.
Local HierarchicalEncoder::State::local(const SurfaceFrame& frame_, Int32x4 difference) const {
  alignas(16) std::int32_t d[4];
  alignas(16) std::int16_t t[8], n[8];
  difference.store(d);
  frame_.tangents.store(t);
  frame_.normal.store(n);
  const float scale = 1.0f / static_cast<float>(1 << (kUnitBits + unit.stepBits));
  const float x = scale * static_cast<float>(d[0]), y = scale * static_cast<float>(d[1]),
              z = scale * static_cast<float>(d[2]);
  const auto dot = [&](const std::int16_t* e) {
    return static_cast<float>(e[0]) * x + static_cast<float>(e[1]) * y + static_cast<float>(e[2]) * z;
  };
  return {dot(t), dot(t + 4), dot(n)};
}

// What is promised is a distance, half the diagonal of a cube of steps: seldom is a vertex in a corner, so
// that a smaller residual along the surface often serves as well. Along the normal, where the eye looks, the
// nearest one stays.
Vectors4 economise(const Local4& wish) {
  Vectors4 r{wish.u.rounded(), wish.v.rounded(), wish.n.rounded()};
  Float32x4 u = wish.u - Float32x4::of(r.x), v = wish.v - Float32x4::of(r.y);
  const Float32x4 n = wish.n - Float32x4::of(r.z);
  const auto tryLess = [&](Float32x4 wished, Int32x4& residual, Float32x4& error) {
    const Int32x4 sign = residual.shiftedRight(31) | Int32x4::all(1);
    const Int32x4 smaller = residual - sign;
    const Float32x4 moved = wished - Float32x4::of(smaller);
    const Float32x4 rest = u * u + v * v + n * n - error * error;
    const Int32x4 stays = (rest + moved * moved > Float32x4::all(0.75f)) | (residual == Int32x4::all(0));
    residual = select(stays, residual, smaller);
    error = select(stays, error, moved);
  };
  // The one that is farther off first.
  const Int32x4 uFirst = u.magnitude() > v.magnitude();
  for (const bool second : {false, true}) {
    const Int32x4 isU = second ? Int32x4::without(uFirst, Int32x4::all(-1)) : uFirst;
    Int32x4 residual = select(isU, r.x, r.y);
    Float32x4 error = select(isU, u, v);
    tryLess(select(isU, wish.u, wish.v), residual, error);
    r.x = select(isU, residual, r.x);
    u = select(isU, error, u);
    r.y = select(isU, r.y, residual);
    v = select(isU, v, error);
  }
  return r;
}

// The residuals of four vertices, and where they lead.
void HierarchicalEncoder::State::choose(std::uint32_t begin, std::size_t first,
                                        std::array<Int32x4, 4>& positions) {
  std::array<Int32x4, 4> differences;
  for (std::size_t i = 0; i < 4; ++i)
    differences[i] =
        wanted[std::min(begin + first + i, vertices - 1)].load() - predictions[first + i].position;
  const Vectors4 d = transposed(differences);
  const SurfaceFrames& f = frames[first / 4];
  const Float32x4 scale = Float32x4::all(1.0f / static_cast<float>(1 << (kUnitBits + unit.stepBits)));
  const Float32x4 x = scale * Float32x4::of(d.x), y = scale * Float32x4::of(d.y),
                  z = scale * Float32x4::of(d.z);
  const auto dot = [&](const Vectors4& e) {
    return Float32x4::of(e.x) * x + Float32x4::of(e.y) * y + Float32x4::of(e.z) * z;
  };
  const Vectors4 r = economise({dot(f.u), dot(f.v), dot(f.n)});
  r.x.store(&residuals[kAlongU][first]);
  r.y.store(&residuals[kAlongV][first]);
  r.z.store(&residuals[kAlongNormal][first]);
  const Vectors4 moved = predictor.moved(f, r);
  const auto squared = [](Int32x4 a) { return Float32x4::of(a) * Float32x4::of(a); };
  const Float32x4 distance = squared(d.x - moved.x) + squared(d.y - moved.y) + squared(d.z - moved.z);
  const int far =
      (beyond16Bits(r) | (distance > Float32x4::all(static_cast<float>(squaredPromise())))).signs();
  positions = transposed(moved);
  for (std::size_t i = 0; i < 4; ++i) {
    positions[i] = positions[i] + predictions[first + i].position;
    if ((far >> i & 1) == 0) continue;
    std::int32_t residual[kComponents];
    for (std::size_t c = 0; c < kComponents; ++c) residual[c] = residuals[c][first + i];
    positions[i] =
        chooseFar(predictions[first + i], predictions[first + i].position + differences[i], residual);
    for (std::size_t c = 0; c < kComponents; ++c) residuals[c][first + i] = residual[c];
  }
}

// The frame is orthonormal to one in thousands: after a long way a second and a third look are needed.
Int32x4 HierarchicalEncoder::State::chooseFar(const Prediction& prediction, Int32x4 target,
                                              std::int32_t* residual) const {
  Int32x4 position = predictor.reconstruct(prediction, residual);
  for (int look = 0; look < 8 && squaredLength(position - target) > squaredPromise(); ++look) {
    const Local rest = local(prediction.frame, target - position);
    residual[kAlongU] += nearest(rest.u);
    residual[kAlongV] += nearest(rest.v);
    residual[kAlongNormal] += nearest(rest.n);
    position = predictor.reconstruct(prediction, residual);
  }
  return position;
}

// Whether the reference serves once more.
bool HierarchicalEncoder::State::isAtRest() const {
  const std::span<const Node> former = predictor.reference();
  const double limit = squaredPromise();
  for (std::size_t slot = 0; slot < vertices; ++slot) {
    if (squaredLength(wanted[slot].load() - former[slot].load()) > limit) return false;
  }
  return true;
}

void HierarchicalEncoder::State::use(const Weights& chosen) {
  used = chosen;
  vectors = weightVectors(used);
}

std::size_t HierarchicalEncoder::State::writeWeights(const FrameRole& role, std::byte* out) {
  const bool key = role.kind == PacketKind::key;
  if (!key && isAtRest()) {
    use(Weights{});
    out[0] = std::byte{1};
    return 1;
  }
  // With layers it is the base that sends the weights of all: it is never left out.
  const bool eager = layers == 1 && frame <= kEagerFrames;
  const bool due = key || (role.layer == 0 && !quiet && (eager || frame % kWeightInterval == 0));
  std::size_t bytes = 0;
  if (due) {
    BitWriter writer(out);
    writer.put(0, 1);
    for (std::size_t of = 0; of < (key ? 1u : layers); ++of) writeChanges(key, of, writer);
    bytes = static_cast<std::size_t>(writer.finish() - out);
  }
  use(weights[role.layer]);
  return bytes;
}

void HierarchicalEncoder::State::writeChanges(bool key, std::size_t of, BitWriter& writer) {
  Weights& current = weights[of];
  Weights next = current;
  fitters[of].fit(next);
  for (std::size_t c = 0; c < kWeightClasses; ++c) {
    const bool changes = classSizes[c] >= kFewVertices && next[c] != current[c];
    writer.put(changes ? 1 : 0, 1);
    if (!changes) continue;
    for (std::size_t f = firstWeight(key); f < endWeight(key); ++f)
      writer.putGamma(zigzag(next[c][f] - current[c][f]), kWeightGammaBits);
    current[c] = next[c];
  }
}

// What a key frame leaves out of account is the past: its weights are fitted to a first attempt at itself.
void HierarchicalEncoder::State::attempt() {
  for (WeightFitter& fitter : fitters) fitter.clear();
  use(weights[0]);
  BitWriter bits(extra.data());
  std::vector<CodedResidual>* const record = std::exchange(recorded, nullptr);
  encodePhases(bits);
  recorded = record;
}

void HierarchicalEncoder::State::encodePhases(BitWriter& bits) {
  symbols.shrink(0);
  quiet = true;
  const Hierarchy& hierarchy = predictor.hierarchy();
  for (std::size_t i = 0; i < hierarchy.phases.size(); ++i) {
    encodePhase(hierarchy.phases[i], bits);
    if (i + 1 != hierarchy.coarsePhases) continue;
    coarseSymbols = symbols.count();
    coarseBytes = bits.bytesSince(extra.data());
  }
}

// What is wanted in the same place for some frames is pinned, it seems: it is to stand still. To say so takes
// two bytes.
bool HierarchicalEncoder::State::startsToRest(std::uint32_t slot, const Prediction& prediction) {
  if (restsLeft == 0 || stillFrames[slot] < kStillFrames || predictor.reference()[slot].rests()) return false;
  if (squaredLength(wanted[slot].load() - prediction.last) > squaredPromise()) return false;
  --restsLeft;
  return true;
}

bool HierarchicalEncoder::State::goesOnResting(std::uint32_t slot, const Prediction& prediction) const {
  return frame > 0 && predictor.reference()[slot].rests() &&
         squaredLength(wanted[slot].load() - prediction.last) <= squaredPromise();
}

// A phase without residuals is a bit that says so, in place of all that was written of it.
void HierarchicalEncoder::State::encodePhase(const Phase& phase, BitWriter& bits) {
  const BitWriter bitsBefore = bits;
  const std::size_t symbolsBefore = symbols.count();
  bits.put(0, 1);
  bool any = false;
  for (std::uint32_t begin = phase.begin; begin < phase.end; begin += kChunk) {
    const std::uint32_t count = std::min(kChunk, phase.end - begin);
    any = encodeChunk(begin, count, phase.weightClass, bits) || any;
  }
  if (any) {
    quiet = false;
    return;
  }
  bits = bitsBefore;
  bits.put(1, 1);
  symbols.shrink(symbolsBefore);
}

bool HierarchicalEncoder::State::encodeChunk(std::uint32_t begin, std::uint32_t count,
                                             std::uint32_t weightClass, BitWriter& bits) {
  const ScaleModel model(kScaleWeights[scaleClassOf(weightClass, frame == 0)]);
  const bool fits = weightClass < kWeightClasses;
  const std::uint32_t stride = fits ? kFitStride[weightClass] : 1;
  bool any = false;
  staying = 0;
  predictor.predict(begin, count, vectors[weightClass], predictions.data(), frames.data());
  for (std::size_t first = 0; first < count; first += 4) {
    const std::size_t four = std::min<std::size_t>(count - first, 4);
    std::array<Int32x4, 4> positions;
    choose(begin, first, positions);
    rest(begin, first, four, positions);
    Int32x4 counted[kComponents];
    for (std::size_t c = 0; c < kComponents; ++c) {
      counted[c] = countedMagnitudes(Int32x4::load(&residuals[c][first]));
      counted[c].store(&magnitudes[c][first]);
    }
    alignas(16) std::int32_t packed[4];
    packMagnitudes(counted[kAlongU], counted[kAlongV], counted[kAlongNormal]).store(packed);
    for (std::size_t i = 0; i < four; ++i) {
      any = any || packed[i] != 0;
      predictor.place(begin + static_cast<std::uint32_t>(first + i), predictions[first + i], positions[i],
                      static_cast<std::uint32_t>(packed[i]));
    }
  }
  codeChunk(count, model, bits);
  for (std::uint32_t i = 0; fits && i < count; ++i) {
    const std::uint32_t slot = begin + i;
    // Others in each frame.
    if ((slot + frame) % stride == 0)
      fitTo(weightClass, predictor.features(slot, predictions[i]), predictions[i], wanted[slot].load(), i);
  }
  if (recorded != nullptr) {
    for (std::size_t i = 0; i < count; ++i) note(predictions[i], weightClass, i);
  }
  return any || staying > 0;
}

// Leaves out the residuals of what rests, or starts to.
void HierarchicalEncoder::State::rest(std::uint32_t begin, std::size_t first, std::size_t count,
                                      std::array<Int32x4, 4>& positions) {
  for (std::size_t i = first; i < first + count; ++i) {
    const std::uint32_t slot = begin + static_cast<std::uint32_t>(i);
    stays[i] = startsToRest(slot, predictions[i]);
    staying += stays[i] ? 1 : 0;
    if (!stays[i] && !goesOnResting(slot, predictions[i])) continue;
    positions[i - first] = predictions[i].last;
    for (auto& component : residuals) component[i] = 0;
  }
}

void HierarchicalEncoder::State::codeChunk(std::size_t count, const ScaleModel& model, BitWriter& bits) {
  std::array<Vectors4, kChunk / 4> expected;
  for (std::size_t i = 0; i < count; i += 4) expected[i / 4] = model.expect(&predictions[i]);
  for (const Component component : kCodingOrder) {
    for (std::size_t first = 0; first < count; first += 4) {
      const Vectors4& e = expected[first / 4];
      const Int32x4 byComponent[]{e.x, e.y, e.z};
      const Int32x4 scales =
          model.scales(component, byComponent[component], Int32x4::load(&magnitudes[kAlongNormal][first]),
                       Int32x4::load(&magnitudes[kAlongU][first]));
      const Int32x4 residual = Int32x4::load(&residuals[component][first]);
      const Int32x4 number = residual.shiftedLeft(1) ^ residual.shiftedRight(31);
      const Int32x4 isHard = (scales > Int32x4::all(15)) | (number > Int32x4::all(kEscape - 1)) | number;
      const std::size_t coder = first % kCoders;
      if (first + 4 <= count && isHard.signs() == 0 && staying == 0) {
        symbols.addFour(coder, scales + Int32x4::all(static_cast<std::int32_t>(distributionOf(component, 0))),
                        number);
        continue;
      }
      alignas(16) std::int32_t scale[4];
      scales.store(scale);
      for (std::size_t i = 0; i < 4 && first + i < count; ++i)
        code(component, static_cast<std::uint32_t>(scale[i]), first + i, coder + i, bits);
    }
  }
}

void HierarchicalEncoder::State::code(Component component, std::uint32_t scale, std::size_t i,
                                      std::size_t coder, BitWriter& bits) {
  if (stays[i]) {
    if (component != kAlongNormal) return;
    bits.putGamma(kStays, kEscapeGammaBits);
    symbols.add(coder, distributionOf(component, scale), kEscape);
    return;
  }
  const unsigned raw = rawBits(scale);
  const std::uint32_t number = zigzag(residuals[component][i]);
  std::uint32_t symbol = number >> raw;
  if (symbol >= kEscape) {
    bits.putGamma(symbol - kEscape + (component == kAlongNormal ? kStays + 1 : 0), kEscapeGammaBits);
    symbol = kEscape;
  }
  if (raw > 0) bits.put(number & ((1u << raw) - 1), raw);
  symbols.add(coder, distributionOf(component, scale), symbol);
}

void HierarchicalEncoder::State::encodeNormals(std::span<const float> normals, BitWriter& bits) {
  const std::span<const FacedNormal> predicted = normalPrediction.predict(layout, predictor);
  std::array<NormalScale, 2> scales;
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    const FacedNormal& expected = predicted[vertex];
    const FacedNormal actual = faceNormal(&normals[3 * vertex], expected.top);
    sentNormals[vertex] = actual;
    const std::array<int, 2> differences{actual.octahedral.u - expected.octahedral.u,
                                         actual.octahedral.v - expected.octahedral.v};
    for (std::size_t c = 0; c < 2; ++c) {
      const auto residual = static_cast<std::int8_t>(differences[c]);
      const std::uint32_t scale = scales[c].scale();
      const unsigned raw = rawBits(scale);
      const std::uint32_t number = zigzag(residual);
      const std::uint32_t symbol = std::min(number >> raw, kEscape);
      if (symbol == kEscape) bits.putGamma((number >> raw) - kEscape, kEscapeGammaBits);
      if (raw > 0) bits.put(number & ((1u << raw) - 1), raw);
      symbols.add((2 * vertex + c) % kCoders, distributionOf(kAlongU, scale), symbol);
      scales[c].add(residual);
    }
  }
}

void HierarchicalEncoder::State::fitTo(std::uint32_t weightClass, const FeatureVectors& features,
                                       const Prediction& prediction, Int32x4 target, std::size_t i) {
  const auto& w = used[weightClass];
  Int32x4 predicted = Int32x4::all(0), turned = predicted;
  for (std::size_t f = 0; f < kFeaturePairs; ++f) {
    Int32x4& sum = f < kPlainPairs ? predicted : turned;
    sum = sum + dotPairs(features[f], Int16x8::allPairs(w[2 * f], w[2 * f + 1]));
  }
  predicted = predicted + turned.shiftedRight(kTurnedBits);
  const Int32x4 goal =
      (target - prediction.position).shiftedRight(unit.stepBits - 4) + predicted.shiftedRight(kWeightBits);
  // What is hard to predict here is not to spoil the weights for the rest.
  const std::uint32_t around = prediction.parentMagnitudes;
  const auto near = static_cast<float>((around & 255u) + (around >> 8 & 255u) + (around >> 16 & 255u));
  const auto own = static_cast<float>(magnitudes[0][i] + magnitudes[1][i] + magnitudes[2][i]);
  fitters[layer].add(weightClass, features, goal, 1 / (0.15f + 0.1f * own * own + 0.025f * near));
}

void HierarchicalEncoder::State::note(const Prediction& prediction, std::uint32_t weightClass,
                                      std::size_t i) {
  for (std::size_t c = 0; c < kComponents; ++c) {
    const auto byte = [c](std::uint32_t bytes) { return static_cast<std::uint8_t>(bytes >> 8 * c); };
    recorded->push_back(
        {static_cast<std::uint8_t>(c), static_cast<std::uint8_t>(scaleClassOf(weightClass, frame == 0)),
         byte(prediction.parentMagnitudes), byte(prediction.ringMagnitudes), byte(prediction.lastMagnitudes),
         static_cast<std::uint8_t>(magnitudes[kAlongNormal][i]),
         static_cast<std::uint8_t>(magnitudes[kAlongU][i]), residuals[c][i]});
  }
}

HierarchicalEncoder::HierarchicalEncoder(const StreamLayout& layout)
    : state_(std::make_unique<State>(layout)) {}
HierarchicalEncoder::~HierarchicalEncoder() = default;

std::size_t HierarchicalEncoder::packetBound() const {
  const State& s = *state_;
  PacketHeader largest = s.header;
  largest.kind = PacketKind::predicted;
  largest.referenceCount = 1;
  return headerBound(largest) + kMaxWeightBytes + s.symbols.bound() + s.extra.size();
}

std::size_t HierarchicalEncoder::encode(const FrameRole& role, std::span<const float> positions,
                                        std::span<const float> normals, std::span<std::byte> out) {
  State& s = *state_;
  const bool key = role.kind == PacketKind::key;
  s.frame = key ? 0 : s.frame + 1;
  s.layer = role.layer;
  s.quantise(positions);
  PacketHeader& header = s.header;
  header.kind = role.kind;
  header.temporalLayer = role.layer;
  header.tick = role.tick;
  header.referenceCount = key ? 0 : 1;
  header.references[0] = role.referenceTick;

  // The header's length depends on the sections' sizes: they are written behind its bound and moved up.
  const std::size_t bodyStart = headerBound(header);
  s.predictor.begin(key, role.referenceLayer);
  s.weights = key ? LayerWeights{keyFrameWeights()} : s.kept[role.referenceLayer];
  // Once in the base is enough: the others refer to it.
  s.restsLeft = key || role.layer > 0 ? 0 : kMostRests;
  if (key) s.attempt();
  std::size_t end = bodyStart + s.writeWeights(role, out.data() + bodyStart);
  header.sectionBytes[kWeightChanges] = static_cast<std::uint32_t>(end - bodyStart);
  BitWriter bits(s.extra.data());
  s.encodePhases(bits);
  if (s.hasNormals) s.encodeNormals(normals, bits);
  s.predictor.keep(role.layer);
  if (key) {
    s.weights.fill(startingWeights());
    for (WeightFitter& fitter : s.fitters) fitter.clear();
  }
  s.kept[role.layer] = s.weights;
  const RansWriter::Written symbols = s.symbols.write(out.data() + end, s.coarseSymbols);
  header.sectionBytes[kCoarseSymbols] = static_cast<std::uint32_t>(symbols.firstBytes);
  header.sectionBytes[kFineSymbols] = static_cast<std::uint32_t>(symbols.bytes - symbols.firstBytes);
  end += symbols.bytes;
  const auto extraBytes = static_cast<std::size_t>(bits.finish() - s.extra.data());
  header.sectionBytes[kCoarseBits] = static_cast<std::uint32_t>(s.coarseBytes);
  header.sectionBytes[kFineBits] = static_cast<std::uint32_t>(extraBytes - s.coarseBytes);
  std::memcpy(out.data() + end, s.extra.data(), extraBytes);
  end += extraBytes;
  const std::size_t headerBytes = writeHeader(header, out);
  std::memmove(out.data() + headerBytes, out.data() + bodyStart, end - bodyStart);
  return headerBytes + (end - bodyStart);
}

std::uint64_t HierarchicalEncoder::reconstructionHash() const {
  return hashNodes(state_->predictor, state_->sentNormals);
}

void HierarchicalEncoder::record(std::vector<CodedResidual>* residuals) {
  state_->recorded = residuals;
}

}  // namespace clothstream::codec::hierarchical

namespace clothstream::codec {

std::unique_ptr<BodyEncoder> makeHierarchicalEncoder(const StreamLayout& layout) {
  return std::make_unique<hierarchical::HierarchicalEncoder>(layout);
}

}  // namespace clothstream::codec
