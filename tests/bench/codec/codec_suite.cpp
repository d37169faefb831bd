// SPDX-License-Identifier: MIT
// Suite codec: the codec on the CPU over motions that it was not fitted to, also with normals, and for a
// square grid as a mesh.
#include <functional>
#include <vector>

#include "server/encode/worker_threads.h"
#include "tests/bench/codec/bench_motion.h"
#include "tests/bench/codec/codec_measurement.h"
#include "tests/bench/codec/our_codec.h"
#include "tests/codec/cut_grid.h"

namespace clothstream::bench {
namespace {

// Frames of a motion in memory, so that each variant has them and the caches to itself.
class Frames {
 public:
  explicit Frames(const BenchMotion& motion) : floats_(3 * std::size_t{motion.cloth.vertexCount}) {
    motion.play([&](std::span<const float> positions) {
      all_.insert(all_.end(), positions.begin(), positions.end());
    });
  }
  std::size_t count() const { return all_.size() / floats_; }
  std::span<const float> operator[](std::size_t frame) const {
    return std::span(all_).subspan(frame * floats_, floats_);
  }

 private:
  std::size_t floats_;
  std::vector<float> all_;
};

// `positionsOf` returns the positions of a frame in the order of the layout's vertices.
nlohmann::ordered_json measure(const std::string& motion, const codec::StreamLayout& layout,
                               std::size_t frames,
                               const std::function<std::span<const float>(std::size_t)>& positionsOf,
                               codec::Workers* workers = nullptr) {
  const codec::ClothLayout& cloth = layout.cloths.front();
  CodecMeasurement measurement(std::make_unique<OurCodec>(layout, workers), cloth, double{layout.maxError});
  Truth truth(cloth);
  for (std::size_t frame = 0; frame < frames; ++frame) measurement.add(truth.next(positionsOf(frame)));
  return measurement.row(motion);
}

}  // namespace

void runCodec(vulkan::Device& device, const Settings& settings, const RowSink& add) {
  for (const BenchMotion& motion : chosenMotions(device, settings)) {
    const Frames frames(motion);
    const auto ofTheGrid = [&](std::size_t frame) { return frames[frame]; };
    codec::StreamLayout layout{.epoch = 1, .maxError = settings.maxError, .cloths = {motion.cloth}};
    for (const auto normals : {codec::NormalMode::none, codec::NormalMode::octahedral}) {
      layout.normals = normals;
      add(measure(motion.name, layout, frames.count(), ofTheGrid));
    }
    if (settings.encoderThreads > 1) {
      encode::WorkerThreads threads(settings.encoderThreads);
      const codec::StreamLayout plain{.epoch = 1, .maxError = settings.maxError, .cloths = {motion.cloth}};
      add(measure(motion.name, plain, frames.count(), ofTheGrid, &threads));
    }
    if (motion.cloth.rows < 2 || motion.cloth.rows != motion.cloth.columns) continue;
    codec::CutGrid cut(motion.cloth.rows);
    const codec::StreamLayout ofAMesh{.epoch = 1, .maxError = settings.maxError, .cloths = {cut.cloth()}};
    add(measure(motion.name, ofAMesh, frames.count(),
                [&](std::size_t frame) { return cut.renumbered(frames[frame]); }));
  }
}

}  // namespace clothstream::bench
