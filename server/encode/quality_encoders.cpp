// SPDX-License-Identifier: MIT
// The encoders of a stream.
#include "server/encode/quality_encoders.h"

#include <utility>

namespace clothstream::encode {

QualityEncoders::QualityEncoders(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                                 const codec::StreamLayout& layout, codec::Workers* workers)
    : device_(device), simulation_(simulation), layout_(layout), workers_(workers) {
  qualities_[0].encoder =
      std::make_unique<FrameEncoder>(device, simulation, layout, Prediction::automatic, workers);
}

FrameEncoder* QualityEncoders::wanted(std::uint8_t quality, Clock::time_point now) {
  Quality& of = qualities_[quality];
  of.lastWanted = now;
  if (of.encoder) return of.encoder.get();
  if (!of.coming.valid()) {
    of.coming = std::async(std::launch::async, [this, quality] {
      return codec::Encoder::make(layout_, {.quality = quality, .workers = workers_});
    });
  } else if (of.coming.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    of.encoder = std::make_unique<FrameEncoder>(device_, simulation_, layout_, of.coming.get());
  }
  return of.encoder.get();
}

void QualityEncoders::unwanted(std::uint8_t quality, Clock::time_point now) {
  Quality& of = qualities_[quality];
  if (of.encoder) of.encoder->forgetHistory();
  const bool idle = !of.encoder || of.encoder->isIdle();
  if (quality > 0 && now - of.lastWanted >= kKept && idle) drop(of);
}

void QualityEncoders::forgetHistory() {
  for (Quality& quality : qualities_)
    if (quality.encoder) quality.encoder->forgetHistory();
}

void QualityEncoders::drop() {
  for (std::size_t i = 1; i < qualities_.size(); ++i) drop(qualities_[i]);
}

void QualityEncoders::drop(Quality& quality) {
  quality.encoder.reset();
  // A future of std::async waits for its thread when it ends.
  if (quality.coming.valid() && quality.coming.wait_for(std::chrono::seconds(0)) == std::future_status::ready)
    quality.coming = {};
}

}  // namespace clothstream::encode
