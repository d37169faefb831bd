// SPDX-License-Identifier: MIT
// The encoders of a stream: one for each quality that a subscriber receives.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <future>
#include <memory>

#include "server/encode/frame_encoder.h"

namespace clothstream::encode {

// The encoder of the finest quality always exists. Other encoders are created on a separate thread when their
// quality is first needed, because that takes long for a large cloth. They are destroyed some time after
// their last use. Belongs to the device's thread.
class QualityEncoders {
 public:
  using Clock = std::chrono::steady_clock;
  // Time after which an unused encoder is destroyed.
  static constexpr std::chrono::seconds kKept{10};

  // Throws the exceptions of FrameEncoder. `device`, `simulation` and `workers` must outlive this object.
  QualityEncoders(const vulkan::Device& device, const simulation::ClothSimulation& simulation,
                  const codec::StreamLayout& layout, codec::Workers* workers);

  FrameEncoder& finest() { return *qualities_[0].encoder; }
  std::uint8_t count() const { return layout_.qualities; }
  // Encoder of a quality that a subscriber needs now; nullptr while it is being created.
  FrameEncoder* wanted(std::uint8_t quality, Clock::time_point now);
  // No subscriber needs the quality now. Its next frame is a key frame.
  void unwanted(std::uint8_t quality, Clock::time_point now);

  // Makes the next frame of each quality a key frame, after a rollback or restore.
  void forgetHistory();
  // Destroys all encoders but the finest; they must be idle. One that is being created stays until the next
  // wanted(), unwanted() or drop() of its quality finds it complete. Does not wait.
  void drop();

 private:
  struct Quality {
    std::future<std::unique_ptr<codec::Encoder>> coming;
    std::unique_ptr<FrameEncoder> encoder;
    Clock::time_point lastWanted{};
  };

  static void drop(Quality& quality);

  const vulkan::Device& device_;
  const simulation::ClothSimulation& simulation_;
  const codec::StreamLayout layout_;
  codec::Workers* const workers_;
  std::array<Quality, codec::kMaxQualities> qualities_;
};

}  // namespace clothstream::encode
