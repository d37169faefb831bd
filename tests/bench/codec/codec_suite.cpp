// SPDX-License-Identifier: MIT
// Suite codec: both codecs on the CPU over motions that they were not fitted to; codec 2 with temporal
// layers, and of a grid as a mesh, too.
#include "tests/bench/codec/bench_motion.h"
#include "tests/bench/codec/codec_measurement.h"
#include "tests/bench/codec/our_codec.h"
#include "tests/codec/cut_grid.h"

namespace clothstream::bench {
namespace {

// Measurements of one cloth.
class Measured {
 public:
  explicit Measured(const codec::ClothLayout& cloth) : cloth_(cloth), truth_(cloth) {}

  void add(const codec::StreamLayout& layout) {
    all_.emplace_back(std::make_unique<OurCodec>(layout), cloth_, double{layout.maxError});
  }
  void next(std::span<const float> positions) {
    const TrueFrame frame = truth_.next(positions);
    for (CodecMeasurement& one : all_) one.add(frame);
  }
  void report(const std::string& motion, Rows& rows) const {
    for (const CodecMeasurement& one : all_) rows.push_back(one.row(motion));
  }

 private:
  codec::ClothLayout cloth_;
  Truth truth_;
  std::vector<CodecMeasurement> all_;
};

}  // namespace

Rows runCodec(vulkan::Device& device, const Settings& settings) {
  Rows rows;
  for (const BenchMotion& motion : chosenMotions(device, settings)) {
    codec::StreamLayout layout{.epoch = 1,
                               .codec = codec::kCodecHierarchical,
                               .maxError = settings.maxError,
                               .cloths = {motion.cloth}};
    Measured asItIs(motion.cloth);
    for (layout.temporalLayers = 1; layout.temporalLayers <= codec::kMaxTemporalLayers;
         ++layout.temporalLayers)
      asItIs.add(layout);
    layout.temporalLayers = 1;
    layout.normals = codec::NormalMode::octahedral;
    asItIs.add(layout);
    layout.codec = codec::kCodecLatticeZstd;
    asItIs.add(layout);
    layout.normals = codec::NormalMode::none;
    asItIs.add(layout);
    layout.codec = codec::kCodecHierarchical;
    // A grid that is square can be cut.
    const bool square = motion.cloth.rows > 0 && motion.cloth.rows == motion.cloth.columns;
    codec::CutGrid cut(square ? motion.cloth.rows : 1);
    Measured asAMesh(cut.cloth());
    layout.cloths = {cut.cloth()};
    if (square) asAMesh.add(layout);
    motion.play([&](std::span<const float> positions) {
      asItIs.next(positions);
      if (square) asAMesh.next(cut.renumbered(positions));
    });
    asItIs.report(motion.name, rows);
    asAMesh.report(motion.name, rows);
  }
  return rows;
}

}  // namespace clothstream::bench
