// SPDX-License-Identifier: MIT
// Encoder of codec 2.
#include "proto/codec/hierarchical/hierarchical_encoder.h"

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <optional>
#include <utility>

#include "proto/codec/hierarchical/frame_coder.h"
#include "proto/codec/hierarchical/frame_writer.h"
#include "proto/codec/hierarchical/weight_fitter.h"
#include "proto/codec/hierarchical/weight_plan.h"

namespace clothstream::codec::hierarchical {
namespace {

// Distances along u, v and n in steps, of one vertex and of four.
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

// Scratch memory of one thread for the chunk that it encodes.
struct ChunkScratch {
  std::array<Prediction, kChunk> predictions;
  std::array<SurfaceFrames, kChunk / 4> frames;
  alignas(16) std::int32_t magnitudes[kComponents][kChunk];  // indexed by component
  ProductSums products;
};

// Result of a chunk, held until it is written.
struct EncodedChunk {
  ChunkResiduals residuals;
  std::uint32_t count = 0;
  bool any = false;   // a vertex stays or has a residual that is not 0
  bool fits = false;  // weights are fitted to this chunk
  ChunkProducts products{};
};

void scale(const ChunkScratch& scratch, std::size_t count, const ScaleModel& model, ChunkResiduals& chunk) {
  for (std::size_t first = 0; first < count; first += 4) {
    const Vectors4 e = model.expect(&scratch.predictions[first]);
    const Int32x4 byComponent[]{e.x, e.y, e.z};
    const Int32x4 n = Int32x4::load(&scratch.magnitudes[kAlongNormal][first]);
    const Int32x4 u = Int32x4::load(&scratch.magnitudes[kAlongU][first]);
    for (const Component c : kCodingOrder)
      model.scales(c, byComponent[c], n, u).store(&chunk.scales[c][first]);
  }
}

// With workers: number of vertices that are encoded before they are written, maximum number of pieces, and
// minimum vertices of a piece.
constexpr std::uint32_t kBatch = 256 * kChunk, kMaxPieces = 16, kLeastPiece = 8 * kChunk;

}  // namespace

struct HierarchicalEncoder::State {
  State(const StreamLayout& streamLayout, const EncoderOptions& options)
      : layout(streamLayout),
        workers(options.workers),
        batch(workers != nullptr ? kBatch : kChunk),
        vertices(layout.vertexCount()),
        hasNormals(layout.normals == NormalMode::octahedral),
        unit(latticeUnit(layout.maxError)),
        wanted(vertices),
        stillFrames(vertices),
        writer(layout),
        sentNormals(hasNormals ? vertices : 0) {
    if (!predictor.allocate(layout, unit.stepBits) || (hasNormals && !normalPrediction.allocate(layout)))
      std::abort();  // memory is out, as in any other allocation here
    fitted.emplace(predictor.hierarchy());
    plan.emplace(predictor.hierarchy(), options.weightLag);
    scratches.resize(workers != nullptr ? kMaxPieces : 1);
    encoded.resize(batch / kChunk);
  }

  // Square of the promised distance, in units: half a step along three axes, and a unit for rounding.
  double squaredPromise() const {
    const double perAxis = (1 << (unit.stepBits - 1)) + 1;
    return 3 * perAxis * perAxis;
  }
  void quantise(std::span<const float> positions);
  Local local(const SurfaceFrame& frame, Int32x4 difference) const;
  void choose(const ChunkScratch& scratch, std::uint32_t begin, std::size_t first, ChunkResiduals& chunk,
              std::array<Int32x4, 4>& positions) const;
  Int32x4 chooseFar(const Prediction& prediction, Int32x4 target, std::int32_t* residual) const;
  bool isAtRest() const;
  void use(const Weights& chosen);
  void attempt();
  void encodePhases();
  bool wantsToRest(std::uint32_t slot) const;
  void countRests();
  bool startsToRest(std::uint32_t slot) const;
  bool goesOnResting(std::uint32_t slot, const Prediction& prediction) const;
  void encodePhase(const Phase& phase);
  // Calls `piece` for parts of a range. With several threads each part has at least `least` elements.
  template <typename Piece>
  void share(std::uint32_t count, std::uint32_t least, const Piece& piece);
  // Encodes the chunk of `phase` that starts at `begin`. `number` counts the chunks of its class, including
  // those of earlier phases.
  void encodeChunk(const Phase& phase, std::uint32_t begin, std::uint32_t number, ChunkScratch& scratch,
                   EncodedChunk& out);
  // Returns whether a vertex stays or has a residual that is not 0.
  bool write(std::uint32_t weightClass, const EncodedChunk& encoded);
  void rest(const ChunkScratch& scratch, std::uint32_t begin, std::size_t first, std::size_t count,
            ChunkResiduals& chunk, std::array<Int32x4, 4>& positions) const;
  void fitTo(ChunkScratch& scratch, std::uint32_t weightClass, const FeatureVectors& features, Int32x4 target,
             std::size_t i) const;
  void encodeNormals(std::span<const float> normals);
  void note(const ChunkScratch& scratch, std::uint32_t weightClass, const ChunkResiduals& chunk,
            std::size_t i);

  StreamLayout layout;
  Workers* workers;
  std::uint32_t batch;  // number of vertices that are encoded before they are written
  std::size_t vertices;
  bool hasNormals;
  LatticeUnit unit;
  Predictor predictor;
  // Positions to encode, in coding order.
  std::vector<Node> wanted;
  std::vector<std::uint8_t> stillFrames;  // frames with an unchanged position, up to kStillFrames
  std::uint32_t restInterval =
      0;  // 1 / restInterval of the vertices may start to rest in this frame; 0: none may
  FrameWriter writer;
  std::optional<FitSchedule> fitted;
  std::array<std::uint32_t, kWeightClasses + 1> chunks{};  // number of chunks of each class coded so far
  std::optional<WeightPlan> plan;
  std::array<std::byte, WeightPlan::kMaxBytes> weightBytes{};
  Weights used{};  // in this frame
  std::array<WeightVectors, kWeightClasses + 1> vectors{};
  std::uint32_t frame = 0;  // number of frames since the key frame
  bool quiet = false;       // true if this frame has no residual
  NormalPrediction normalPrediction;
  std::vector<FacedNormal> sentNormals;  // indexed by vertex
  std::vector<CodedResidual>* recorded = nullptr;
  std::vector<ChunkScratch> scratches;  // one for each piece
  std::vector<EncodedChunk> encoded;    // chunks of a batch
};

void HierarchicalEncoder::State::quantise(std::span<const float> positions) {
  constexpr double limit = kMaxWanted;
  const Array<std::uint32_t>& vertexOf = predictor.hierarchy().vertexOf;
  const double perUnit = quantisationScale(unit.unit);
  const auto coordinate = [&](float x) {
    const double q = static_cast<double>(x) * perUnit;
    if (!(q >= -limit)) return -kMaxWanted;  // also catches NaN
    return q > limit ? kMaxWanted : simde_mm_cvtsd_si32(simde_mm_set_sd(q));
  };
  const auto quantiseSlots = [&](std::uint32_t, std::uint32_t begin, std::uint32_t end) {
    for (std::size_t slot = begin; slot < end; ++slot) {
      const float* p = &positions[3 * std::size_t{vertexOf[slot]}];
      const Node next{coordinate(p[0]), coordinate(p[1]), coordinate(p[2]), 0};
      const bool still = next.load().sameThree(wanted[slot].load());
      stillFrames[slot] =
          still ? static_cast<std::uint8_t>(std::min<std::uint32_t>(stillFrames[slot] + 1u, kStillFrames))
                : 0;
      wanted[slot] = next;
    }
  };
  share(static_cast<std::uint32_t>(vertices), 4 * kLeastPiece, quantiseSlots);
}

// Result in steps.
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

// The promise is a distance: half the diagonal of a cube of steps. A vertex is seldom in a corner of the
// cube, so a smaller residual along the surface often keeps the promise too. Along the normal, where errors
// are most visible, the nearest residual stays.
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
  // Starts with the component that has the larger error.
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

// Chooses the residuals of four vertices and computes the positions that they lead to.
void HierarchicalEncoder::State::choose(const ChunkScratch& scratch, std::uint32_t begin, std::size_t first,
                                        ChunkResiduals& chunk, std::array<Int32x4, 4>& positions) const {
  const auto& predictions = scratch.predictions;
  std::array<Int32x4, 4> differences;
  for (std::size_t i = 0; i < 4; ++i)
    differences[i] =
        wanted[std::min(begin + first + i, vertices - 1)].load() - predictions[first + i].position;
  const Vectors4 d = transposed(differences);
  const SurfaceFrames& f = scratch.frames[first / 4];
  const Float32x4 scale = Float32x4::all(1.0f / static_cast<float>(1 << (kUnitBits + unit.stepBits)));
  const Float32x4 x = scale * Float32x4::of(d.x), y = scale * Float32x4::of(d.y),
                  z = scale * Float32x4::of(d.z);
  const auto dot = [&](const Vectors4& e) {
    return Float32x4::of(e.x) * x + Float32x4::of(e.y) * y + Float32x4::of(e.z) * z;
  };
  const Vectors4 r = economise({dot(f.u), dot(f.v), dot(f.n)});
  r.x.store(&chunk.residuals[kAlongU][first]);
  r.y.store(&chunk.residuals[kAlongV][first]);
  r.z.store(&chunk.residuals[kAlongNormal][first]);
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
    for (std::size_t c = 0; c < kComponents; ++c) residual[c] = chunk.residuals[c][first + i];
    positions[i] =
        chooseFar(predictions[first + i], predictions[first + i].position + differences[i], residual);
    for (std::size_t c = 0; c < kComponents; ++c) chunk.residuals[c][first + i] = residual[c];
  }
}

// The frame is orthonormal only to about 1 in 1000, so a long way needs further passes.
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

// True if the reference keeps the promise for every vertex.
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

void HierarchicalEncoder::State::encodePhases() {
  writer.begin();
  quiet = true;
  chunks.fill(0);
  const Hierarchy& hierarchy = predictor.hierarchy();
  for (std::size_t i = 0; i < hierarchy.phases.size(); ++i) {
    encodePhase(hierarchy.phases[i]);
    if (i + 1 == hierarchy.coarsePhases) writer.endCoarse();
  }
}

void HierarchicalEncoder::State::attempt() {
  plan->retry();
  use(plan->used());
  std::vector<CodedResidual>* const record = std::exchange(recorded, nullptr);
  encodePhases();
  recorded = record;
}

// A vertex whose position stays the same for some frames is probably pinned, and shall stand still. This
// costs two bytes.
bool HierarchicalEncoder::State::wantsToRest(std::uint32_t slot) const {
  if (stillFrames[slot] < kStillFrames) return false;
  const Node& former = predictor.reference()[slot];
  return !former.rests() && squaredLength(wanted[slot].load() - former.load()) <= squaredPromise();
}

void HierarchicalEncoder::State::countRests() {
  std::uint32_t candidates = 0;
  for (std::uint32_t slot = 0; slot < vertices; ++slot) candidates += wantsToRest(slot) ? 1 : 0;
  restInterval = (candidates + kRestsAtOnce - 1) / kRestsAtOnce;
}

bool HierarchicalEncoder::State::startsToRest(std::uint32_t slot) const {
  return restInterval > 0 && wantsToRest(slot) && (slot + frame) % restInterval == 0;
}

bool HierarchicalEncoder::State::goesOnResting(std::uint32_t slot, const Prediction& prediction) const {
  return frame > 0 && predictor.reference()[slot].rests() &&
         squaredLength(wanted[slot].load() - prediction.last) <= squaredPromise();
}

template <typename Piece>
void HierarchicalEncoder::State::share(std::uint32_t count, std::uint32_t least, const Piece& piece) {
  const std::uint32_t pieces = workers == nullptr ? 1 : std::clamp(count / least, 1u, kMaxPieces);
  if (pieces == 1) return piece(0, 0, count);
  const auto at = [&](std::uint32_t i) {
    return static_cast<std::uint32_t>(std::uint64_t{count} * i / pieces);
  };
  const auto part = [&](std::uint32_t i) { piece(i, at(i), at(i + 1)); };
  workers->run(pieces, std::ref(part));
}

void HierarchicalEncoder::State::encodePhase(const Phase& phase) {
  writer.beginPhase();
  bool any = false;
  std::uint32_t& number = chunks[phase.weightClass];
  for (std::uint32_t first = phase.begin; first < phase.end; first += batch) {
    const std::uint32_t count = (std::min(batch, phase.end - first) + kChunk - 1) / kChunk;
    share(count, kLeastPiece / kChunk, [&](std::uint32_t piece, std::uint32_t begin, std::uint32_t end) {
      for (std::uint32_t i = begin; i < end; ++i)
        encodeChunk(phase, first + i * kChunk, number + i, scratches[piece], encoded[i]);
    });
    number += count;
    for (std::uint32_t i = 0; i < count; ++i) any = write(phase.weightClass, encoded[i]) || any;
  }
  writer.endPhase(any);
  quiet = quiet && !any;
}

void HierarchicalEncoder::State::encodeChunk(const Phase& phase, std::uint32_t begin, std::uint32_t number,
                                             ChunkScratch& scratch, EncodedChunk& out) {
  const std::uint32_t weightClass = phase.weightClass, count = std::min(kChunk, phase.end - begin);
  const ScaleModel model(kScaleWeights[scaleClassOf(weightClass, frame == 0)]);
  ChunkResiduals& chunk = out.residuals;
  out.count = count;
  out.fits = weightClass < kWeightClasses && fitted->isFitted(weightClass, number, frame);
  out.any = chunk.anyStays = false;
  predictor.predict(begin, count, vectors[weightClass], scratch.predictions.data(), scratch.frames.data());
  for (std::size_t first = 0; first < count; first += 4) {
    const std::size_t four = std::min<std::size_t>(count - first, 4);
    std::array<Int32x4, 4> positions;
    choose(scratch, begin, first, chunk, positions);
    rest(scratch, begin, first, four, chunk, positions);
    Int32x4 counted[kComponents];
    for (std::size_t c = 0; c < kComponents; ++c) {
      counted[c] = countedMagnitudes(Int32x4::load(&chunk.residuals[c][first]));
      counted[c].store(&scratch.magnitudes[c][first]);
    }
    const Int32x4 packed = packMagnitudes(counted[kAlongU], counted[kAlongV], counted[kAlongNormal]);
    out.any = out.any || (~(packed == Int32x4::all(0)).signs() & ((1 << four) - 1)) != 0;
    predictor.place(begin + static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(four),
                    &scratch.predictions[first], positions, packed);
  }
  out.any = out.any || chunk.anyStays;
  scale(scratch, count, model, chunk);
  for (std::uint32_t i = 0; out.fits && i < count; ++i) {
    const std::uint32_t slot = begin + i;
    fitTo(scratch, weightClass, predictor.features(slot, scratch.predictions[i]), wanted[slot].load(), i);
  }
  if (out.fits) out.products = scratch.products.take();
  if (recorded != nullptr) {
    for (std::size_t i = 0; i < count; ++i) note(scratch, weightClass, chunk, i);
  }
}

bool HierarchicalEncoder::State::write(std::uint32_t weightClass, const EncodedChunk& chunk) {
  writer.add(chunk.residuals, chunk.count);
  if (chunk.fits) plan->add(weightClass, chunk.products);
  return chunk.any;
}

// Removes the residuals of vertices that rest or start to rest.
void HierarchicalEncoder::State::rest(const ChunkScratch& scratch, std::uint32_t begin, std::size_t first,
                                      std::size_t count, ChunkResiduals& chunk,
                                      std::array<Int32x4, 4>& positions) const {
  for (std::size_t i = first; i < first + count; ++i) {
    const std::uint32_t slot = begin + static_cast<std::uint32_t>(i);
    chunk.stays[i] = startsToRest(slot);
    chunk.anyStays = chunk.anyStays || chunk.stays[i];
    if (!chunk.stays[i] && !goesOnResting(slot, scratch.predictions[i])) continue;
    positions[i - first] = scratch.predictions[i].last;
    for (auto& component : chunk.residuals) component[i] = 0;
  }
}

void HierarchicalEncoder::State::fitTo(ChunkScratch& scratch, std::uint32_t weightClass,
                                       const FeatureVectors& features, Int32x4 target, std::size_t i) const {
  const Prediction& prediction = scratch.predictions[i];
  const auto& w = used[weightClass];
  Int32x4 predicted = Int32x4::all(0), turned = predicted;
  for (std::size_t f = 0; f < kFeaturePairs; ++f) {
    Int32x4& sum = f < kPlainPairs ? predicted : turned;
    sum = sum + dotPairs(features[f], Int16x8::allPairs(w[2 * f], w[2 * f + 1]));
  }
  predicted = predicted + turned.shiftedRight(kTurnedBits);
  const Int32x4 goal =
      (target - prediction.position).shiftedRight(unit.stepBits - 4) + predicted.shiftedRight(kWeightBits);
  // Vertices that are hard to predict get a low weight, so that they do not spoil the weights for the others.
  const std::uint32_t around = prediction.parentMagnitudes;
  const std::uint32_t near = (around & 255u) + (around >> 8 & 255u) + (around >> 16 & 255u);
  const auto own = static_cast<std::uint32_t>(scratch.magnitudes[0][i] + scratch.magnitudes[1][i] +
                                              scratch.magnitudes[2][i]);
  scratch.products.add(features, goal, roughReciprocal(6 + 4 * own * own + near));
}

void HierarchicalEncoder::State::encodeNormals(std::span<const float> normals) {
  const std::span<const FacedNormal> predicted = normalPrediction.predict(layout, predictor);
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    const Octahedral& expected = predicted[vertex].octahedral;
    sentNormals[vertex] = faceNormal(&normals[3 * vertex], predicted[vertex].top);
    const Octahedral& sent = sentNormals[vertex].octahedral;
    writer.addNormal(static_cast<std::int8_t>(sent.u - expected.u),
                     static_cast<std::int8_t>(sent.v - expected.v));
  }
}

void HierarchicalEncoder::State::note(const ChunkScratch& scratch, std::uint32_t weightClass,
                                      const ChunkResiduals& chunk, std::size_t i) {
  const Prediction& prediction = scratch.predictions[i];
  for (std::size_t c = 0; c < kComponents; ++c) {
    const auto byte = [c](std::uint32_t bytes) { return static_cast<std::uint8_t>(bytes >> 8 * c); };
    recorded->push_back(
        {static_cast<std::uint8_t>(c), static_cast<std::uint8_t>(scaleClassOf(weightClass, frame == 0)),
         byte(prediction.parentMagnitudes), byte(prediction.ringMagnitudes), byte(prediction.lastMagnitudes),
         static_cast<std::uint8_t>(scratch.magnitudes[kAlongNormal][i]),
         static_cast<std::uint8_t>(scratch.magnitudes[kAlongU][i]), chunk.residuals[c][i]});
  }
}

HierarchicalEncoder::HierarchicalEncoder(const StreamLayout& layout, const EncoderOptions& options)
    : state_(std::make_unique<State>(layout, options)) {}
HierarchicalEncoder::~HierarchicalEncoder() = default;

std::size_t HierarchicalEncoder::packetBound() const {
  return state_->writer.packetBound();
}

std::size_t HierarchicalEncoder::encode(const FrameRole& role, std::span<const float> positions,
                                        std::span<const float> normals, std::span<std::byte> out) {
  State& s = *state_;
  const bool key = role.kind == PacketKind::key;
  s.frame = key ? 0 : s.frame + 1;
  s.quantise(positions);
  s.predictor.begin(key);
  s.plan->begin(key);
  s.restInterval = 0;
  if (!key) s.countRests();
  // A key frame cannot use the past, so its weights are fitted to a first attempt at the same frame.
  if (key && s.plan->attempts()) s.attempt();
  const std::size_t weightBytes = s.plan->write(!key && s.isAtRest(), s.weightBytes.data());
  s.use(s.plan->used());
  s.encodePhases();
  if (s.hasNormals) s.encodeNormals(normals);
  s.predictor.keep();
  s.plan->end(s.quiet);
  return s.writer.write(role, std::span(s.weightBytes).first(weightBytes), out);
}

std::uint64_t HierarchicalEncoder::reconstructionHash() const {
  return hashNodes(state_->predictor, state_->sentNormals);
}

void HierarchicalEncoder::record(std::vector<CodedResidual>* residuals) {
  state_->recorded = residuals;
}

}  // namespace clothstream::codec::hierarchical
