// SPDX-License-Identifier: MIT
// Codec 2: the CPU codes residuals that are read back.
#include <algorithm>

#include "proto/codec/hierarchical/rans_frame_writer.h"
#include "server/encode/device_output.h"

namespace clothstream::encode {
namespace {

class CodedOutput final : public DeviceOutput {
 public:
  CodedOutput(const DevicePredictor& predictor, const codec::StreamLayout& layout)
      : predictor_(predictor), writer_(layout) {}

  std::size_t packetBound() const override { return writer_.packetBound(); }
  void record(vulkan::Recorder&, std::uint32_t) override {}

  Written write(std::uint32_t slot, const codec::FrameRole& role, std::span<const std::byte> weights,
                std::span<std::byte> out) override {
    bool any = false;
    writer_.begin();
    const codec::hierarchical::Hierarchy& hierarchy = predictor_.hierarchy();
    for (std::size_t i = 0; i < hierarchy.phases.size(); ++i) {
      any = writePhase(slot, hierarchy.phases[i]) || any;
      if (i + 1 == hierarchy.coarsePhases) writer_.endCoarse();
    }
    for (const std::uint32_t normal : predictor_.normalResiduals(slot))
      writer_.addNormal(static_cast<std::int8_t>(normal), static_cast<std::int8_t>(normal >> 8));
    return {writer_.write(role, weights, out), any};
  }

 private:
  // Returns true if the phase has a residual.
  bool writePhase(std::uint32_t slot, const codec::hierarchical::Phase& phase) {
    bool any = false;
    writer_.beginPhase();
    for (std::uint32_t begin = phase.begin; begin < phase.end; begin += codec::hierarchical::kChunk) {
      const std::uint32_t count = std::min(codec::hierarchical::kChunk, phase.end - begin);
      any = predictor_.read(slot, begin, count, chunk_) || any;
      writer_.add(chunk_, count);
    }
    writer_.endPhase(any);
    return any;
  }

  const DevicePredictor& predictor_;
  codec::hierarchical::RansFrameWriter writer_;
  codec::hierarchical::ChunkResiduals chunk_;
};

}  // namespace

std::unique_ptr<DeviceOutput> makeCodedOutput(const DevicePredictor& predictor,
                                              const codec::StreamLayout& layout) {
  return std::make_unique<CodedOutput>(predictor, layout);
}

}  // namespace clothstream::encode
