// SPDX-License-Identifier: MIT
// Our codec compared with raw floats, Draco, meshoptimizer and zstd. They alternate frame by frame.
#include <array>
#include <optional>
#include <stdexcept>

#include "tests/bench/codec/bench_motion.h"
#include "tests/bench/codec/codec_measurement.h"
#include "tests/bench/codec/our_codec.h"
#include "tests/bench/peers/peer_codecs.h"
#include "tests/bench/peers/peers.h"

namespace clothstream::bench {
namespace {

// Max errors of the curves.
constexpr std::array kErrors{0.0001, 0.0002, 0.0005, 0.001, 0.002};

// Our codec, then the others, all at this max error.
std::vector<CodecMeasurement> measurements(const codec::ClothLayout& cloth, double maxError) {
  std::vector<CodecMeasurement> all;
  all.emplace_back(std::make_unique<OurCodec>(codec::StreamLayout{
                       .epoch = 1, .maxError = static_cast<float>(maxError), .cloths = {cloth}}),
                   cloth, maxError);
  for (std::unique_ptr<FrameCodec>& peer : peerCodecs(cloth, maxError))
    all.emplace_back(std::move(peer), cloth, maxError);
  return all;
}

void play(const BenchMotion& motion, std::vector<CodecMeasurement>& all) {
  Truth truth(motion.cloth);
  motion.play([&](std::span<const float> positions) {
    const TrueFrame frame = truth.next(positions);
    for (CodecMeasurement& one : all) one.add(frame);
  });
}

}  // namespace

Rows compareCodecs(vulkan::Device& device, const Settings& settings) {
  Rows rows;
  for (const BenchMotion& motion : chosenMotions(device, settings)) {
    std::vector<CodecMeasurement> all = measurements(motion.cloth, double{settings.maxError});
    all.emplace_back(rawFloats(), motion.cloth, 0);
    play(motion, all);
    for (const CodecMeasurement& one : all) rows.push_back(one.row(motion.name));
  }
  return rows;
}

Rows codecCurves(vulkan::Device& device, const Settings& settings) {
  Rows rows;
  for (const BenchMotion& motion : chosenMotions(device, settings)) {
    std::vector<CodecMeasurement> all;
    for (const double maxError : kErrors)
      for (CodecMeasurement& one : measurements(motion.cloth, maxError)) all.push_back(std::move(one));
    play(motion, all);
    for (const CodecMeasurement& one : all) rows.push_back(one.row(motion.name));
  }
  return rows;
}

}  // namespace clothstream::bench
