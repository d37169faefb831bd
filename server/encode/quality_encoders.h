// SPDX-License-Identifier: MIT
// The encoders of a stream: one for each quality that somebody gets.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>

#include "server/encode/frame_encoder.h"

namespace clothstream::encode {

// The finest quality's is always there. That of another is made when it is first wanted, on a thread of its
// own, for that of a large cloth takes long, and is gone some time after it was wanted last. Belongs to the
// device's thread.
class QualityEncoders {
 public:
  using Clock = std::chrono::steady_clock;
  // After which one that nobody wants is gone.
  static constexpr std::chrono::seconds kKept{10};

  // Throws what FrameEncoder throws. `device`, `simulation` and `workers` outlive it.
  QualityEncoders(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                  const codec::StreamLayout& layout, codec::Workers* workers);

  FrameEncoder& finest() { return *qualities_[0].encoder; }
  std::uint8_t count() const { return layout_.qualities; }
  // Of one of them, which somebody wants now; nullptr while it is made.
  FrameEncoder* wanted(std::uint8_t quality, Clock::time_point now);
  // Nobody wants it now: its next frame is a key frame.
  void unwanted(std::uint8_t quality, Clock::time_point now);

  // After a rollback or restore: the next frame of each is a key frame.
  void forgetHistory();
  // All but the finest; they must be idle.
  void drop();

 private:
  struct Quality {
    std::future<std::unique_ptr<codec::Encoder>> coming;
    std::unique_ptr<FrameEncoder> encoder;
    Clock::time_point lastWanted{};
  };

  const vulkan::Device& device_;
  const simulation::ClothSimulation& simulation_;
  const codec::StreamLayout layout_;
  codec::Workers* const workers_;
  std::array<Quality, codec::kMaxQualities> qualities_;
};

}  // namespace clothstream::encode
